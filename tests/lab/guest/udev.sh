# Sourced by a suite, again after every plugging: entries of udev's database for the video and media nodes,
# which libcamera waits for. No udevd runs in the guest.
mkdir -p /run/udev/data
for number in /sys/class/video4linux/*/dev /sys/bus/media/devices/*/dev; do
  echo I:1 >"/run/udev/data/c$(cat "$number")"
done
