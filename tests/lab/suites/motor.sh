# The motor model counts what the kernel's own tools set, and moves the switches.
. "$LAB_DIR/guest/gpio.sh"
mkfifo ask
"$LAB_BIN/lab_motor" state 1234 400 <ask >ready &
exec 3>ask
until [ -s ready ]; do sleep 0.1; done
counted() { # waits for the model to have seen all that was set
  rm -f state
  echo >&3
  until [ -e state ]; do sleep 0.1; done
  cat state
}
level() { cat "$GPIO_SYSFS/sim_gpio$1/value"; }
[ "$(counted | sed -n 2p)" = "lift 400 0 1" ]
[ "$(level 8)" = 0 ] # endstop
"$LAB_BIN/lab_toggle" scan-lab 4 250 # direction is low: down
[ "$(counted | sed -n 2p)" = "lift 150 250 1" ]
"$LAB_BIN/lab_toggle" scan-lab 4 150
[ "$(counted | sed -n 2p)" = "lift 0 400 1" ]
[ "$(level 8)" = 1 ]
"$LAB_BIN/lab_toggle" scan-lab 0 1234 # one turn is 36000
[ "$(counted | sed -n 1p)" = "turntable 0 1234 1" ]
[ "$(level 3)" = 1 ] # index
exec 3>&-
wait
