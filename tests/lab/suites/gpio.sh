# libgpiod on the kernel's lines: the contract of GPIO lines, and the driver's rate beside a bare loop's.
. "$LAB_DIR/guest/gpio.sh"
"$LAB_BIN/lab_gpio_contract" --gtest_brief=1
"$LAB_BIN/lab_toggle" scan-lab 11 2000 15
