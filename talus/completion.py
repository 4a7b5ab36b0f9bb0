"""Completion of commands, studies and files by the shell."""

SHELLS = ("bash", "zsh")

_BASH = """\
_talus() {
  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]} command=${COMP_WORDS[1]}
  if ((COMP_CWORD == 1)); then
    COMPREPLY=($(compgen -W "run list new info completion" -- "$word"))
  elif [[ $command == completion ]]; then
    COMPREPLY=($(compgen -W "bash zsh" -- "$word"))
  elif [[ $command == run && ($before == run || ${COMP_WORDS[COMP_CWORD-2]} == --ranks) ]]; then
    COMPREPLY=($(compgen -W "--ranks $(talus list | awk '{print $1}')" -- "$word") $(compgen -f -X '!*.py' -- "$word"))
  else
    COMPREPLY=($(compgen -f -- "$word"))
  fi
}
complete -o filenames -F _talus talus
"""


def completion(shell: str) -> str:
    """The text that a shell reads: ``source <(talus completion bash)``."""
    return _BASH if shell == "bash" else "autoload -Uz bashcompinit && bashcompinit\n" + _BASH
