# Sourced by a suite: a simulated board of 24 lines, labelled scan-lab, with the lines of a station.
#   $GPIO_BASE   number of its first line as the kernel's trace events give it
#   $GPIO_SYSFS  folder with sim_gpioN/{value,pull} for each line
modprobe gpio-sim
board=/sys/kernel/config/gpio-sim/station
mkdir -p $board/bank0
echo 24 >$board/bank0/num_lines
echo scan-lab >$board/bank0/label
line=0
for name in TURNTABLE_STEP TURNTABLE_DIR TURNTABLE_EN TURNTABLE_INDEX \
            LIFT_STEP LIFT_DIR LIFT_EN LIFT_BRAKE LIFT_ENDSTOP ESTOP COVER LAMP; do
  mkdir $board/bank0/line$line
  echo $name >$board/bank0/line$line/name
  line=$((line + 1))
done
echo 1 >$board/live
GPIO_SYSFS=/sys/devices/platform/$(cat $board/dev_name)/$(cat $board/bank0/chip_name)
for chip in /sys/class/gpio/gpiochip*; do
  [ "$(cat "$chip/label")" = scan-lab ] && GPIO_BASE=$(cat "$chip/base")
done
export GPIO_BASE GPIO_SYSFS
