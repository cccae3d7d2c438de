#!/usr/bin/env bash
# usage: station.sh before|after SCENE BIN RUN STATION   what the host does for a suite of a whole station:
# the pictures that its camera will show, made once, and the model from the session that it captured.
set -euo pipefail
when=$1 scene=$2 bin=$3 run=$4 station=$5
here=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd)
if [ "$when" = before ]; then
  mkdir -p "$(dirname "$scene")"
  exec 9>"$scene.lock" && flock 9 # stations share a scene, and their suites run side by side
  [ "$scene/index" -nt "$here/$station.toml" ] && [ "$scene/index" -nt "$bin/lab_pictures" ] && exit
  exec "$bin/lab_pictures" "$here/$station.toml" "$scene"
fi
"$bin/scanstation" reconstruct "$run/session" --mesh "$scene/surface.ply" --out "$run/model" --force >"$run/model.log" 2>&1
"$bin/scanstation" evaluate "$run/model" --truth "$scene/truth.json" --session "$run/session" \
  --mesh "$scene/surface.ply" --json >"$run/figures.json"
python3 - "$run/figures.json" <<'P'
import json, sys
f = json.load(open(sys.argv[1]))
turn, outline = f["rotation_after_alignment_deg"], f["contour_px"]
print("figure: %d of %d views accepted, rotation %.3f deg median, %.3f max; outline %.3f px median"
      % (f["accepted"], f["views"], turn["median"], turn["max"], outline["median"]))
sys.exit(not (f["accepted"] == f["views"] == 12 and turn["max"] <= 0.2 and outline["median"] <= 1.0))
P
