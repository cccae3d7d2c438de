# The guest itself: every kernel driver that the other suites stand on is there and alive.
. "$LAB_DIR/guest/gpio.sh"
[ "$(cat "$GPIO_SYSFS/sim_gpio0/value")" = 0 ]
echo pull-up >"$GPIO_SYSFS/sim_gpio0/pull"
[ "$(cat "$GPIO_SYSFS/sim_gpio0/value")" = 1 ]
. "$LAB_DIR/guest/uvc.sh"
modprobe vivid n_devs=1 node_types=0x1 num_inputs=1 input_types=0 vid_cap_nr=10
grep -H . /sys/class/video4linux/*/name
grep -q dummy_udc /sys/class/video4linux/*/name # the gadget's side; the camera comes when it is fed
grep -q vivid /sys/class/video4linux/video10/name
