#!/bin/sh
# Improves a motion step by step with curl and python3: it creates a study, evaluates the present motion, and repeats the
# best suggestion until the energy is below the threshold, or until no suggestion saves energy.
#   make serve, then in another terminal: sh examples/study_loop.sh [http://127.0.0.1:8000]
set -eu
url=${1:-http://127.0.0.1:8000}
here=$(dirname "$0")

# Prints the value of a Python expression of the answer `a`, which is read from standard input.
pick() { python3 -c "import json, sys; a = json.load(sys.stdin); print($1)"; }
post() { curl --silent --show-error --fail-with-body --header 'Content-Type: application/json' --data "$2" "$url$1"; }

study=$(post /studies "$(cat "$here/studies/paper_pose_1.json")" | pick 'a["id"]')
echo "study $study"
# the motion of the paper to its first configuration, in 1.5 s
answer=$(post "/studies/$study/iterations" '{"evaluate": {"time_per_segment": 1.5, "configurations":
  [[0, -1.5708, 1.5708, -1.5708, 3.1416, 0], [-0.1243, -0.9639, 1.6165, -2.2211, 4.7124, 0.1251]]}}')
while :; do
  echo "$answer" | pick '"iteration {number}: {energy:.1f} J in {duration:.2f} s, threshold {threshold:g} J".format(**a)'
  if [ "$(echo "$answer" | pick 'a["threshold_met"]')" = True ]; then
    echo "low enough"
    break
  fi
  next=$(curl --silent --show-error --fail-with-body "$url/studies/$study/suggest")
  if [ "$(echo "$next" | pick 'bool(a["suggestions"]) and a["suggestions"][0]["gain"] > 0.1')" = False ]; then
    echo "nothing is left to gain"
    break
  fi
  echo "$next" | pick '"next: {summary} It saves {gain:.1f} J.".format(**a["suggestions"][0])'
  answer=$(post "/studies/$study/iterations" "$(echo "$next" | pick 'json.dumps(a["suggestions"][0]["request"])')")
done
curl --silent --show-error --header 'Accept: text/csv' "$url/studies/$study"
