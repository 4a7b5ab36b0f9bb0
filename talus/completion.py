"""Completion of commands, studies, their options and files by the shell."""

_BASH = """\
_talus() {
  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]} command=${COMP_WORDS[1]} study=${COMP_WORDS[2]}
  [[ $study != --ranks ]] || study=${COMP_WORDS[4]}
  if ((COMP_CWORD == 1)); then
    COMPREPLY=($(compgen -W "run list new info completion --version" -- "$word"))
  elif [[ $command == completion ]]; then
    COMPREPLY=($(compgen -W "bash zsh fish" -- "$word"))
  elif [[ $command == run && ($before == run || ${COMP_WORDS[COMP_CWORD-2]} == --ranks) ]]; then
    COMPREPLY=($(compgen -W "--ranks $(talus list | awk '{print $1}')" -- "$word") $(compgen -f -X '!*.py' -- "$word"))
  elif [[ $command == run && $word == -* ]]; then
    COMPREPLY=($(compgen -W "$(talus run "$study" --help 2>/dev/null | grep -oE -e '--[a-z0-9-]+' | sort -u)" -- "$word"))
  else
    COMPREPLY=($(compgen -f -- "$word"))
  fi
}
complete -o filenames -F _talus talus
"""

_ZSH = """\
autoload -Uz compinit bashcompinit
(( $+functions[compdef] )) || compinit
bashcompinit
"""

_FISH = """\
function _talus_options
  set -l words (commandline -opc)
  set -l place 3
  contains -- --ranks $words[3]; and set place 5
  set -q words[$place]; and talus run $words[$place] --help 2>/dev/null | string match -ra -- '--[a-z0-9-]+'
end
complete -c talus -f -n __fish_use_subcommand -a "run list new info completion"
complete -c talus -f -n __fish_use_subcommand -l version -d "print the version"
complete -c talus -f -n "__fish_seen_subcommand_from list new info"
complete -c talus -f -n "__fish_seen_subcommand_from completion" -a "bash zsh fish"
complete -c talus -x -n "__fish_seen_subcommand_from run" -l ranks -d "number of ranks"
complete -c talus -n "__fish_seen_subcommand_from run; and string match -q -- '-*' (commandline -ct)" -a "(_talus_options)"
complete -c talus -n "__fish_seen_subcommand_from run" -a "(talus list | string replace -r '^ *(\\\\S+) +' '\\$1\\t')"
"""

SCRIPTS = {"bash": _BASH, "zsh": _ZSH + _BASH, "fish": _FISH}
"""Scripts for shells, ``source <(talus completion bash)`` or ``talus completion fish | source``"""
