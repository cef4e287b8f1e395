#!/usr/bin/env bash
# Speed and memory of `analyze` and `diff` on logs of 1 GB, against reading and decompressing them in the same run.
#
# usage: big_log.sh FOLDER [PAIRS]   (FOLDER takes 4 GB; PAIRS of measurements, default 3)
set -euo pipefail
folder=$1 pairs=${2:-3}
root=$(cd "$(dirname "$0")/../.." && pwd)
cargo build --release --manifest-path "$root/Cargo.toml" -p agglo
cargo build --release --manifest-path "$root/Cargo.toml" -p agglo-replay --example decompress
agglo=$root/target/release/agglo yardstick=$root/target/release/examples/decompress
mkdir -p "$folder"
cd "$folder"
# A gas of 1000 without fields, and the clustering cloud with all of its effects.
[ -e gas.mcap ] || "$agglo" run "$root/scenes/free-cooling-gas.json" -q --set 'record={"every_steps":1}' --set duration=2400 -o gas.mcap
[ -e cloud.mcap ] || "$agglo" run "$root/scenes/clustering.json" -q --set duration=1600 -o cloud.mcap
# Elapsed and processor time, and the most memory.
timed() { /usr/bin/time -f '%e s, %U + %S s of processors, %M KiB' "$@" 2>&1 >/dev/null | tail -n 1; }
for log in gas cloud; do
  [ -e $log-2.mcap ] || cp $log.mcap $log-2.mcap
  echo "== $log.mcap, $(stat -c %s $log.mcap) bytes"
  cat $log.mcap $log-2.mcap > /dev/null
  for pair in $(seq "$pairs"); do
    echo "read and decompress  $(timed "$yardstick" $log.mcap)"
    echo "analyze              $(timed "$agglo" analyze $log.mcap)"
    echo "read and decompress both  $(timed "$yardstick" $log.mcap $log-2.mcap)"
    echo "diff                      $(timed "$agglo" diff $log.mcap $log-2.mcap)"
    echo "diff --profile state      $(timed "$agglo" diff $log.mcap $log-2.mcap --profile state)"
  done
done
