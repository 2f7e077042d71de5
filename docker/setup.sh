# Shared by ./demo, ./check and docker/e2e, which source it after setting `root` to the repository's root.
# shellcheck shell=bash

die() {
  printf '%s: error: %s\n' "${0##*/}" "$*" >&2
  exit 1
}

say() { printf '\n== %s\n' "$*"; }

# The packages in docker/packages.txt for one use: build, engine or clang (see the list's head).
packages_for() {
  awk -v use="$1" '{ sub(/#.*/, "") } NF && (NF == 1 ? "build" : $2) == use { print $1 }' "${root:?}/docker/packages.txt"
}

# The packages among the arguments that are not installed.
missing_packages() {
  local package
  for package in "$@"; do
    dpkg-query -W -f '${db:Status-Abbrev}\n' "$package" 2>/dev/null | grep -q '^ii' || printf '%s\n' "$package"
  done
}

# Runs a command as root: directly, or through sudo, which may ask for a password only where someone can answer.
as_root() {
  if ((EUID == 0)); then
    "$@"
  elif [[ -t 0 ]]; then
    sudo "$@"
  else
    sudo -n "$@"
  fi
}

apt_update() {
  as_root apt-get -o DPkg::Lock::Timeout=900 update || echo "apt-get update failed; going on with the lists at hand" >&2
}

# Installs what is missing of the packages for the given uses. Touches neither apt nor root where nothing is missing.
install_missing() {
  local use wanted=() missing=()
  for use in "$@"; do mapfile -t -O "${#wanted[@]}" wanted < <(packages_for "$use"); done
  ((${#wanted[@]} > 0)) || die "docker/packages.txt lists nothing for: $*"
  if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
    die "this is not a Debian system. Install the equivalents of docker/packages.txt (${wanted[*]}), then build with:
  cmake --preset release && cmake --build --preset release"
  fi
  mapfile -t missing < <(missing_packages "${wanted[@]}")
  ((${#missing[@]} > 0)) || return 0
  ((EUID == 0)) || command -v sudo >/dev/null ||
    die "packages are missing, and there is no sudo. As root, run: apt-get install --no-install-recommends ${missing[*]}"
  say "Installing ${missing[*]}"
  apt_update
  as_root env DEBIAN_FRONTEND=noninteractive \
    apt-get -o DPkg::Lock::Timeout=900 install -y --no-install-recommends "${missing[@]}" </dev/null ||
    die "apt-get could not install: ${missing[*]}. It names the cause above; all that is needed is in docker/packages.txt"
}

# Configures and builds everything with one of the presets in CMakePresets.json, on all cores.
build_preset() {
  say "Building ($1)"
  (cd "$root" && cmake --preset "$1" && cmake --build --preset "$1" -j "$(nproc)") ||
    die "the $1 build failed; the first error stands above"
}

# debian_model PACKAGE MODEL DIR: unpacks MODEL, and nothing else, out of a Debian package into DIR without installing
# the package. MODEL is a path inside the package, or "ARCHIVE:MEMBER" for a file in a .tar.gz inside it.
# Prints the path of the unpacked file. What is there from an earlier run is used again.
debian_model() {
  local package=$1 model=$2 directory=$3
  local file=$directory/${model##*/} deb
  if [[ ! -s $file ]]; then
    mkdir -p "$directory"
    download_package "$package" "$directory" >&2 || return 1
    deb=$(find "$directory" -name "${package}_*.deb" -print -quit)
    if [[ $model == *:* ]]; then
      dpkg-deb --fsys-tarfile "$deb" | tar xOf - "./${model%%:*}" | tar xOzf - "${model#*:}" >"$file.part" || return 1
    else
      dpkg-deb --fsys-tarfile "$deb" | tar xOf - "./$model" >"$file.part" || return 1
    fi
    [[ -s $file.part ]] || return 1
    mv "$file.part" "$file"
    rm -f "$deb"
  fi
  printf '%s\n' "$file"
}

# apt-get download needs no root, but package lists; a plain container has none.
download_package() (
  cd "$2" || exit 1
  apt-get download "$1" 2>/dev/null && exit 0
  apt_update
  apt-get download "$1"
)

# The models of ./demo and docker/e2e: scanned or sculpted, from Debian packages.
demo_model() {
  local directory=$1
  debian_model libcgal-demo usr/share/doc/libcgal-dev/data.tar.gz:data/meshes/bunny00.off "$directory" && return
  echo "libcgal-demo could not be had; trying assimp-testmodels" >&2
  debian_model assimp-testmodels usr/share/assimp/models/glTF2/2CylinderEngine-glTF-Binary/2CylinderEngine.glb "$directory"
}

# The name of the only model in what `fanstream-client list --json` prints, which comes on standard input.
only_model() { jq -er 'first(.. | objects | .name // empty)'; }
