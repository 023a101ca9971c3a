# Functions for other releases of Debian than the one that runs; sourced. They need root, debootstrap and
# debian-archive-keyring for roots, and take mirror, proxies and certificates from this system.

# debian_suite: the name of this system's release.
debian_suite() {
  # shellcheck source=/dev/null
  (. /etc/os-release && echo "${VERSION_CODENAME:-}")
}

debian_mirror() {
  local mirror
  # shellcheck disable=SC2016  # apt expands
  mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Label: Debian' | sed -n 1p)
  [[ -n $mirror ]] || { echo "dev: add a Debian mirror to the sources of apt, and run apt-get update" >&2; return 1; }
  echo "$mirror"
}

# debian_apt SUITE ARG...: apt-get with packages and sources of that suite alone. Its lists are in build/apt/SUITE.
debian_apt() {
  local suite=$1 folder=$PWD/build/apt/$1 mirror
  mirror=$(debian_mirror) || return
  mkdir -p "$folder/parts" "$folder/lists/partial" "$folder/archives/partial"
  printf 'Types: deb deb-src\nURIs: %s\nSuites: %s\nComponents: main\nSigned-By: %s\n' \
    "$mirror" "$suite" /usr/share/keyrings/debian-archive-keyring.gpg >"$folder/parts/debian.sources"
  local apt=(apt-get -qq -o Dir::Etc::sourcelist=/nonexistent -o "Dir::Etc::sourceparts=$folder/parts"
    -o "Dir::State::lists=$folder/lists" -o "Dir::Cache=$folder" -o APT::Sandbox::User=root)
  "${apt[@]}" update && (cd "$folder" && "${apt[@]}" "${@:2}")
}

# make_debian_root SUITE ROOT PACKAGE...: a minimal system with these packages besides. It has the folder groundray when it
# is complete.
make_debian_root() {
  local suite=$1 root=$2 mirror
  [[ ! -d $root/groundray ]] || return 0
  mirror=$(debian_mirror) || return
  echo "dev: making a Debian ($suite) in ${root#"$PWD/"}"
  rm -rf --one-file-system "$root"
  mkdir -p "$root"
  unshare --mount --propagation private debootstrap --variant=minbase "--include=$(IFS=,; echo "ca-certificates,${*:3}")" \
    --keyring=/usr/share/keyrings/debian-archive-keyring.gpg "$suite" "$root" "$mirror" >"$root.log" ||
    { echo "dev: debootstrap failed; see $root.log" >&2; return 1; }
  apt-config dump | grep -iE '^Acquire::https?::' >"$root/etc/apt/apt.conf.d/90host" || true
  find /usr/local/share/ca-certificates -name '*.crt' -exec cp -t "$root/usr/local/share/ca-certificates" {} +
  chroot "$root" update-ca-certificates >/dev/null 2>&1
  mkdir "$root/groundray"
}

# in_debian_root ROOT COMMAND...: runs there. Mounts are made in a separate namespace, so none outlives the last process in
# it. Shared data, if there are any, are in /shared/data.
in_debian_root() {
  local root=$1 shared=${GROUNDRAY_SHARED_DATA:-../shared/data}
  cp /etc/resolv.conf /etc/hosts "$root/etc/"
  mkdir -p "$root/shared/data"
  # shellcheck disable=SC2016  # the inner shell expands
  unshare --mount --propagation private bash -euc 'root=$1 shared=$2
    mount -t proc proc "$root/proc"
    mount --rbind /sys "$root/sys"
    mount --rbind /dev "$root/dev"
    [[ ! -d $shared ]] || mount --bind -o ro "$shared" "$root/shared/data"
    exec chroot "$root" /usr/bin/env -u GROUNDRAY_SHARED_DATA -u CCACHE_DIR -u PIP_FIND_LINKS HOME=/root LC_ALL=C.UTF-8 \
      WARNINGS_AS_ERRORS=1 \
      PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin "${@:3}"' \
    in_debian_root "$root" "$shared" "${@:2}"
}
