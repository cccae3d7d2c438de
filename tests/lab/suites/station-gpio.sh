# The programs on real lines: scanstation-motiond moves the motors, scanstation device asks it, and what
# the lines do when it dies, on kernels that release them and on kernels that keep driving them.
# limit: 600
. "$LAB_DIR/guest/gpio.sh"
config=$LAB_DIR/../../configs/station-lab.toml
sock=$PWD/motiond.sock
device() { timeout 120 "$LAB_BIN/lab_scanstation" device "$@"; }
mkfifo ask
"$LAB_BIN/lab_motor" state -400 300 <ask >ready &
exec 3>ask
until [ -s ready ]; do sleep 0.1; done
counted() { # POSITION of MOTOR
  rm -f state
  echo >&3
  until [ -e state ]; do sleep 0.1; done
  sed -n "s/^$1 \(-\?[0-9]*\) .*/\1/p" state
}
powered() { awk -v motor="$1" '$1 == motor { print $4 }' state; }
start() { # the socket of one that was killed is still there
  rm -f "$sock"
  "$LAB_BIN/scanstation-motiond" --config "$config" --socket "$sock" 2>>motiond.log &
  motiond=$!
  until [ -S "$sock" ]; do sleep 0.2; done
}

device gpio list | tee list
grep -q 'TURNTABLE_STEP' list
"$LAB_BIN/lab_scanstation" doctor --config "$config" --json >doctor
grep -q '"ready": true' doctor
start
device gpio list | grep -q "TURNTABLE_STEP *held by 'scanstation turntable step'"
device motion status --socket "$sock" | grep -q 'turntable *unpowered'
fails device motion move --turntable-deg 1 --lift-mm 1 --socket "$sock" 2>refused
grep -q 'home' refused
device motion home --socket "$sock"
turntable=$(counted turntable) lift=$(counted lift)
device motion move --turntable-deg 12.5 --lift-mm 8 --socket "$sock" --json >moved
grep -q '"counted": 12.5' moved
[ $(($(counted turntable) - turntable)) = 1250 ]
[ $(($(counted lift) - lift)) = 2250 ] # from -1 mm
echo "figure: moved by hand through scanstation-motiond: 1250 and 2250 steps, as commanded"

# The lamp is lit as long as its client lives, and nobody else switches it meanwhile.
lamp() { cat "$GPIO_SYSFS/sim_gpio11/value"; }
[ "$(lamp)" = 0 ]
"$LAB_BIN/lab_scanstation" device light on --socket "$sock" &
client=$!
until [ "$(lamp)" = 1 ]; do sleep 0.2; done
fails device light off --socket "$sock" 2>refused
grep -q 'another client' refused
kill -9 $client
until [ "$(lamp)" = 0 ]; do sleep 0.2; done
device light on --seconds 0.1 --socket "$sock"
[ "$(lamp)" = 0 ]

# The emergency stop, seen from outside.
device motion move --turntable-deg -1 --lift-mm 1 --socket "$sock" # near the switches: homing is short
echo pull-up >"$GPIO_SYSFS/sim_gpio9/pull"
until device motion status --socket "$sock" | grep -q 'alarm *invalid: emergency stop'; do sleep 0.2; done
counted lift >/dev/null
[ "$(powered turntable)$(powered lift)" = 00 ]
echo pull-down >"$GPIO_SYSFS/sim_gpio9/pull"
until device motion acknowledge --socket "$sock" | grep -q 'alarm *none'; do sleep 0.2; done
device motion home --socket "$sock"

# It dies. With the pull-ups that are to be wired the motors lose their current; a kernel that keeps
# driving the lines leaves it on, and no step is made in either case.
for kept in no yes; do
  for enable in 2 6; do
    [ $kept = yes ] && pull=pull-down || pull=pull-up # the level it had: current on
    echo $pull >"$GPIO_SYSFS/sim_gpio$enable/pull"
  done
  before=$(counted turntable)
  kill -9 $motiond
  wait $motiond || true
  for enable in 2 6; do
    level=$(cat "$GPIO_SYSFS/sim_gpio$enable/value")
    [ $kept$level = yes0 ] || [ $kept$level = no1 ]
  done
  [ "$(counted turntable)" = "$before" ]
  start # takes the lines again, with the current off until homed
  [ "$(cat "$GPIO_SYSFS/sim_gpio2/value")" = 1 ]
  device motion home --socket "$sock" >/dev/null
done
kill $motiond
wait $motiond
exec 3>&-
wait
