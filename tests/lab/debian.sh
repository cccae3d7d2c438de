#!/usr/bin/env bash
# usage: debian.sh VERSION ROOT SOURCE PACKAGE...   the drivers of SOURCE built on another Debian: a root
# file system at ROOT with those packages, the programs of the lab in ROOT/build/bin (the capture side
# only). Made once, brought up to date by every call. Needs root, as debootstrap and chroot do.
set -euo pipefail
version=$1 root=$2 source=$3
shift 3
die() { echo "lab: $*" >&2; exit 1; }
declare -A suites=([12]=bookworm [13]=trixie)
suite=${suites[$version]:-}
[ -n "$suite" ] || die "Debian '$version' is not known here; known are: ${!suites[*]}"
[ "$(id -u)" -eq 0 ] || die "a file system of Debian $version is made by root: sudo ./run lab --debian $version"

if [ ! -f "$root/etc/debian_version" ]; then
  echo "making a root file system of Debian $version" >&2
  rm -rf "$root.new"
  mkdir -p "$root.new"
  debootstrap --variant=minbase --include=ca-certificates "$suite" "$root.new" >"$root.log" 2>&1 ||
    die "debootstrap of $suite failed: $(tail -n 1 "$root.log"); is Debian's archive reachable?"
  mv "$root.new" "$root"
fi

# What is mounted here is gone with this process.
inside() {
  unshare --mount bash -eu -c '
    root=$1 source=$2
    shift 2
    mkdir -p "$root/src"
    mount --bind "$source" "$root/src"
    mount -o remount,ro,bind "$root/src"
    mount -t proc proc "$root/proc"
    mount --rbind /dev "$root/dev"
    exec chroot "$root" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root DEBIAN_FRONTEND=noninteractive \
      CCACHE_DIR=/var/cache/ccache "$@"' - "$root" "$source" "$@"
}

missing=$(for package in "$@"; do
  dpkg-query --admindir="$root/var/lib/dpkg" -W -f='${db:Status-Abbrev}' "$package" 2>/dev/null | grep -q '^.i' ||
    echo "$package"
done | xargs)
if [ -n "$missing" ]; then
  echo "installing in Debian $version: $missing" >&2
  inside sh -c "apt-get -qq update && apt-get -qqy install --no-install-recommends $missing" >"$root.log" 2>&1 ||
    die "a package could not be installed: $(tail -n 1 "$root.log") (log: $root.log)"
fi
echo "building in Debian $version" >&2
inside sh -c 'cmake -S /src --preset release -B /build -DSCAN_RECONSTRUCTION=OFF -DSCAN_WERROR=ON &&
  cmake --build /build --target lab_programs -- -j "$(nproc)"' >"$root.log" 2>&1 || {
  grep -E "error|FAILED" "$root.log" | head -n 20 >&2 || true
  die "the build in Debian $version failed (log: $root.log)"
}
