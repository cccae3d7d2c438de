# Motion through libgpiod: counts over 200,000 steps, stop, abort, emergency stop, limits, broken switches.
# limit: 600
. "$LAB_DIR/guest/gpio.sh"
"$LAB_BIN/lab_motion_laws"
