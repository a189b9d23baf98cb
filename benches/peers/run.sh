#!/bin/sh
# Fits of flexcal and of Ceres in turn on the same data, one thread each, and the ratios of their times.
#
#   benches/peers/run.sh [poses ...]          default: 28 100 1000 10000
#
# Needs a C++17 compiler and Ceres with its headers (Debian, Ubuntu: apt-get install g++ libceres-dev; this pulls in
# Eigen and glog). Installs nothing itself; writes to target/peers only.
set -eu
cd "$(dirname "$0")/../.."
out=target/peers
mkdir -p "$out"
g++ -std=c++17 -O3 -DNDEBUG -I/usr/include/eigen3 benches/peers/ceres/fit.cc -lceres -lglog -o "$out/ceres"
flexcal=$(cargo bench --bench peers --no-run 2>&1 | sed -n 's/.*(\(.*\)).*/\1/p' | tail -1)

printf '%8s  %10s %6s  %10s %6s  %10s %6s  %8s %8s\n' \
    poses flexcal steps 'Ceres QR' steps 'Cholesky' steps '/QR' '/Chol.'
for poses in "${@:-28 100 1000 10000}"; do for poses in $poses; do
    "$flexcal" write "$poses" "$out/ur10.csv"
    repeats=$((20000 / poses + 5))
    # Three rounds in turn; the best median of each, so that a neighbour's load spoils neither.
    for round in 1 2 3; do
        echo "flexcal $("$flexcal" fit "$poses" $repeats)"
        echo "qr $("$out/ceres" "$out/ur10.csv" qr $repeats)"
        echo "cholesky $("$out/ceres" "$out/ur10.csv" cholesky $repeats)"
    done | awk -v poses="$poses" '
        !($1 in best) || $2 < best[$1] { best[$1] = $2 }
        { cost[$1] = $3; steps[$1] = $4 }
        END {
            printf "%8d  %7.3f ms %6d  %7.3f ms %6d  %7.3f ms %6d  %8.2f %8.2f\n", poses, best["flexcal"], steps["flexcal"],
                best["qr"], steps["qr"], best["cholesky"], steps["cholesky"],
                best["flexcal"] / best["qr"], best["flexcal"] / best["cholesky"]
            if (cost["flexcal"] > cost["qr"] * (1 + 1e-8)) { print "flexcal stops above: " cost["flexcal"] " " cost["qr"]; exit 1 }
        }'
done; done
