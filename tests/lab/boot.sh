#!/usr/bin/env bash
# usage: boot.sh LAB RUN SUITE BIN [ROOT]   boots the guest of LAB (see build.sh) and runs SUITE there as
# root. The guest sees this machine's files read-only with changes kept in its memory (those of ROOT where
# it is given, see debian.sh: with this repository at /src and BIN inside of it), and RUN as /out: what the
# suite prints goes to RUN/log, the kernel's messages to RUN/dmesg and RUN/console. In the suite
# $LAB_DIR is tests/lab, $LAB_BIN is BIN, $LAB_SCENE is RUN/../../scene, with a folder for each
# station (see host/station.sh). A line '# limit: SECONDS' in the suite limits its time
# (default 180). The exit status is the suite's; 124 when it ran out of time, 125 when the guest died.
set -euo pipefail
here=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd)
lab=$1 run=$2 suite=$3 bin=$4 root=${5:-}
limit=$(sed -n 's/^# limit: \([0-9]\+\).*/\1/p' "$suite" | head -n 1)
rm -rf "$run"
mkdir -p "$run"
cp "$suite" "$run/suite.sh"
cp "$here/guest/main" "$run/main"
dir=$here
[ -z "$root" ] || dir=/src/tests/lab
printf 'LAB_DIR=%q\nLAB_BIN=%q\nLAB_SCENE=%q\n' "$dir" "$bin" "$(dirname "$(dirname "$run")")/scene" >"$run/environment"

# Waiting for a file of the host is waiting too, and the guest's time jumps meanwhile: a program that the
# host's disk is slow to give would be late for every timer. What the suites load is therefore read once
# before anything runs against the clock.
within() { if [ -n "$root" ]; then chroot "$root" "$@"; else "$@"; fi; }
within sh -c 'for program in "$1"/lab_* "$1"/scanstation?*; do echo "$program"; ldd "$program"; done 2>/dev/null |
    grep -o "/[^ ]*"
  find /usr/lib/*-linux-gnu/libgphoto2* /usr/lib/*-linux-gnu/libcamera -name "*.so*" 2>/dev/null || true' sh "$bin" |
  sort -u >"$run/loaded"

# The guest's processor is emulated, so nothing depends on what the host can virtualise, and its time
# counts instructions (4 ns each; while it sleeps it jumps to the next timer): what a suite sees does not
# depend on how busy the host is, and waiting costs nothing. One processor: with more the guest's would
# run in turns of 100 ms.
status=0
timeout "${limit:-180}" qemu-system-x86_64 -M pc -accel tcg -icount shift=2,sleep=off -cpu max -smp 1 -m 1024 \
  -nodefaults -no-user-config -display none -no-reboot -serial "file:$run/console" -monitor none \
  -kernel "$lab/vmlinux" -initrd "$lab/initrd.cpio" \
  -fsdev local,id=r,path=/,security_model=none,readonly=on,multidevs=remap \
  -device virtio-9p-pci,fsdev=r,mount_tag=hostroot \
  -fsdev "local,id=o,path=$run,security_model=none" -device virtio-9p-pci,fsdev=o,mount_tag=hostout \
  -object rng-random,id=rng0,filename=/dev/urandom -device virtio-rng-pci,rng=rng0 \
  -append "console=ttyS0 panic=-1 mitigations=off nokaslr random.trust_cpu=on tsc=reliable quiet labmods=$lab/lib/modules${root:+ labroot=$root labsource=$(realpath "$here/../..")}" \
  </dev/null >"$run/qemu.log" 2>&1 || status=$?
[ "$status" -eq 124 ] && exit 124
[ -f "$run/status" ] && exit "$(cat "$run/status")"
exit 125
