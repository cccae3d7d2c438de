# Motion through libgpiod: the contract of Motion.
# limit: 400
. "$LAB_DIR/guest/gpio.sh"
"$LAB_BIN/lab_motion_contract"
