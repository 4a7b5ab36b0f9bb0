# Set-up shared by studies/run and tests/run; sourced, not run, by a script that sets `program`, its name in messages.
#
# set_up [extra Debian packages ...] installs what is missing, builds Release into build/ and leaves
#   root    the repository
#   python  the Python that can import dolfinx
# with PYTHONPATH and OMP_NUM_THREADS exported. Any number of calls at once take turns.

root=$(dirname "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")")
build=$root/build
log=$build/setup.log

# What a study needs. ninja, git and ffmpeg could be done without, but make it faster or nicer. OpenBLAS, without threads of its
# own, factorises matrices some ten times as fast as the BLAS that is there by default.
packages=(cmake ninja-build g++ git libopenmpi-dev openmpi-bin libptscotch-dev libeigen3-dev pybind11-dev
  python3-dev libgtest-dev libgmock-dev python3-dolfinx python3-gmsh gmsh python3-mpi4py python3-petsc4py
  python3-numpy python3-h5py libopenblas0-serial python3-matplotlib python3-pil python3-tqdm python3-jinja2 python3-scipy
  python3-rasterio ffmpeg)
# What the tests need besides.
test_packages=(gfortran python3-pytest python3-pytest-xdist python3-hypothesis python3-meshio python3-pandas python3-scipy
  python3-vtk9 chromium chromium-driver python3-selenium clang-format black mypy zsh fish)
docs_packages=(python3-sphinx python3-myst-parser python3-sphinx-rtd-theme libjs-mathjax)

say() { printf "%s: %s\n" "$program" "$*" >&2; }
die() { say "$*"; exit 1; }

die_with_log() {
  say "$1; the end of $log:"
  tail -n 30 "$log" >&2
  exit 1
}

# One process needs neither a network nor a daemon of its own: Open MPI then starts in a tenth of a second, otherwise in four.
# Other MPI libraries take no notice.
start_alone() { export OMPI_MCA_ess_singleton_isolated=1 OMPI_MCA_pml=ob1; }

# Rank under mpirun or srun; empty in a plain call.
rank_in_job() { printf '%s' "${OMPI_COMM_WORLD_RANK:-${PMIX_RANK:-${PMI_RANK:-}}}"; }

set_up() {
  local rank
  rank=$(rank_in_job)
  if [[ ${rank:-0} == 0 ]]; then
    set_up_here "$@"
  else
    wait_for_first_rank
  fi
  read -r python <"$build/python_used" || die "cannot read $build/python_used"
  export PYTHONPATH=$build/python:$root${PYTHONPATH:+:$PYTHONPATH}
  export OMP_NUM_THREADS=${OMP_NUM_THREADS:-1}
}

set_up_here() {
  if ! mkdir -p "$build" 2>/dev/null || [[ ! -w $build ]]; then die "cannot write to $build"; fi
  local stamp=
  find "$build" -maxdepth 1 -name 'job_*' -mmin +60 -delete
  [[ -z $(rank_in_job) ]] || stamp=$(job_stamp)
  # The subshell holds the lock, so that neither the study nor what it starts inherits it.
  if (
    flock 9
    choose_python
    install_missing "$@"
    [[ -n $python ]] || choose_python
    [[ -n $python ]] || die "no Python here can import dolfinx (tried ${tried[*]}).
  Install DOLFINx (Debian: apt-get install python3-dolfinx; conda: conda install -c conda-forge fenics-dolfinx mpich),
  or set PYTHON to the interpreter that has it."
    build_release
  ) 9>"$build/lock"; then
    [[ -z $stamp ]] || echo ready >"$stamp"
  else
    [[ -z $stamp ]] || echo failed >"$stamp"
    exit 1
  fi
}

# --- several ranks: the first one sets up and leaves a stamp, the others wait for it ---

# A file named after the MPI job, the same on all ranks of a job and on no other job's.
job_stamp() {
  local job=${PMIX_NAMESPACE:-}${OMPI_MCA_orte_hnp_uri:-}${SLURM_JOB_ID:-}${SLURM_STEP_ID:-}
  [[ -n $job ]] || job=$PPID-$(awk '{print $22}' "/proc/$PPID/stat" 2>/dev/null)
  printf '%s/job_%s' "$build" "$(cksum <<<"$job" | tr -d ' ')"
}

wait_for_first_rank() {
  local stamp
  stamp=$(job_stamp)
  until [[ -s $stamp ]]; do sleep 0.1; done
  [[ $(<"$stamp") == ready ]] || exit 1
}

# --- Python ---

# Sets `python` to the first of $PYTHON, python3 and /usr/bin/python3 that can import dolfinx, else to nothing;
# `tried` holds those that were asked.
choose_python() {
  local candidate path
  python=
  tried=()
  for candidate in ${PYTHON:+"$PYTHON"} python3 /usr/bin/python3; do
    tried+=("$candidate")
    if path=$(command -v "$candidate") && can_import_dolfinx "$path"; then
      python=$path
      return
    fi
    [[ $candidate != "${PYTHON:-}" ]] || say "PYTHON=$PYTHON cannot import dolfinx; looking further"
  done
}

# A true import takes more than a second, so it is done once for each interpreter; later it is enough that the
# package is still there.
can_import_dolfinx() {
  local interpreter known=$build/python_known
  interpreter=$(readlink -f "$1")
  if grep -qxsF "$1 $interpreter" "$known"; then
    "$1" -c 'import importlib.util, sys; sys.exit(importlib.util.find_spec("dolfinx") is None)' 2>/dev/null && return
  fi
  "$1" -c 'import dolfinx' >/dev/null 2>&1 || return 1
  echo "$1 $interpreter" >>"$known"
}

# --- packages ---

installed_packages() { dpkg-query -W -f '${db:Status-Status} ${Package}\n' 2>/dev/null | sed -n 's/^installed //p'; }

# Installs those of the packages that Debian's package list says are not there. A Python that is not Debian's own but
# has DOLFINx belongs to another stack (conda, a module system), which brings its own compiler and libraries.
install_missing() {
  [[ -z $python || $(readlink -f "$python") == /usr/bin/python3* ]] || return 0
  if ! command -v apt-get >/dev/null || ! command -v dpkg-query >/dev/null; then
    [[ -n $python ]] || say "this system has no apt-get; needed are CMake, a C++20 compiler, MPI, Eigen, pybind11," \
      "GoogleTest, and for Python: DOLFINx, gmsh, mpi4py, h5py, petsc4py, matplotlib"
    return 0
  fi
  local missing
  missing=$(comm -13 <(installed_packages | sort -u) <(printf '%s\n' "${packages[@]}" "$@" | sort -u))
  [[ -n $missing ]] || return 0
  local as_root=(env)
  if [[ $(id -u) != 0 ]]; then
    command -v sudo >/dev/null || die "these Debian packages are missing, and there is no sudo to install them: ${missing//$'\n'/ }"
    as_root=(sudo env)
  fi
  say "installing from Debian: ${missing//$'\n'/ }"
  as_root+=(DEBIAN_FRONTEND=noninteractive apt-get -o DPkg::Lock::Timeout=600 -q -y)
  "${as_root[@]}" update >"$log" 2>&1 || die_with_log "apt-get update failed"
  # shellcheck disable=SC2086 # one word for each package
  "${as_root[@]}" install --no-install-recommends $missing >>"$log" 2>&1 || die_with_log "apt-get install failed"
}

# --- build ---

build_release() {
  local used=
  [[ ! -e $build/python_used ]] || read -r used <"$build/python_used"
  if [[ $used != "$python" || ! -e $build/CMakeCache.txt ]]; then
    say "Python: $python; configuring"
    configure || die_with_log "CMake could not configure the build"
    echo "$python" >"$build/python_used"
  else
    say "Python: $python"
  fi
  (set -o pipefail; cmake --build "$build" 2>&1 | tee "$log" | say_when_building) || die_with_log "the build failed"
}

# Says one line when there is something to compile, none when there is not.
say_when_building() {
  local line said=
  while read -r line; do
    [[ -z $said && $line == *Building* ]] || continue
    say "building (a few minutes the first time)"
    said=1
  done
}

configure() {
  local generator=()
  [[ -e $build/CMakeCache.txt ]] || ! command -v ninja >/dev/null || generator=(-G Ninja)
  (cd "$root" && cmake --preset release "${generator[@]}" "-DPython_EXECUTABLE=$python") >"$log" 2>&1
}
