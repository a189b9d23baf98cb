#!/bin/sh
# The same fit by flexcal and by others, in turn, one thread each: times, their ratios, and whether the minimum is reached.
#
#   benches/peers/run.sh [poses/unknowns[/kind] ...]    default: 100/25 1000/25 100/33 1000/33, and 28 and 200 of each other kind with 25
#
# unknowns: 25 identifiable parameters of a rigid UR10, or all 33 of its joints and target, of which 8 are redundant.
# kind: plain, box (bounds that a few true values lie beyond), huber, l1 (gross errors in a tenth of the poses, and that loss). SciPy's
# losses count coordinates, not poses: its optimum is another one, and its cost is above. lmfit and pybotics have none; pybotics no bounds.
#
# Ceres needs a C++17 compiler and Ceres with its headers (Debian, Ubuntu: apt-get install g++ libceres-dev; this pulls in
# Eigen and glog). SciPy, lmfit and pybotics come from PyPI, in the versions of requirements.txt, into target/peers/venv,
# which is made on the first run (python3 with venv). What is missing is left out, and said. Nothing else is installed,
# and nothing outside target is written. pybotics takes minutes (ended
# after five): PEERS="qr cholesky scipy" leaves out all but those.
set -eu
cd "$(dirname "$0")/../.."
out=target/peers
peers=${PEERS:-qr cholesky scipy scipy-jac dogbox lmfit pybotics}
mkdir -p "$out"
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1

without() {
    echo "left out: $*" >&2
    for peer in "$@"; do peers=$(echo " $peers " | sed "s/ $peer / /"); done
}
g++ -std=c++17 -O3 -DNDEBUG -I/usr/include/eigen3 benches/peers/ceres/fit.cc -lceres -lglog -o "$out/ceres" ||
    without qr cholesky
python=$out/venv/bin/python
[ -x "$python" ] || python3 -m venv "$out/venv" || true
"$python" -m pip install --quiet --disable-pip-version-check -r benches/peers/requirements.txt ||
    without scipy scipy-jac dogbox lmfit pybotics
flexcal=$(cargo bench --bench peers --no-run 2>&1 | sed -n 's/.*(\(.*\)).*/\1/p' | tail -1)

# Prints: median time [ms], final cost, steps or evaluations. Slow ones are measured less often.
fit() {
    case $1 in
        flexcal) "$flexcal" fit "$poses" "$unknowns" "$kind" $((20000 / poses + 5)) ;;
        qr | cholesky) "$out/ceres" "$out/ur10.csv" "$1" $((20000 / poses + 5)) ;;
        pybotics) timeout 300 "$python" benches/peers/python/fit.py "$out/ur10.csv" "$1" 1 || echo 300000 1e99 0 ;;
        *) "$python" benches/peers/python/fit.py "$out/ur10.csv" "$1" $((2000 / poses + 3)) ;;
    esac
}

# Whether a tool has the kind.
has() {
    case $kind/$1 in
        plain/dogbox | box/pybotics | huber/lmfit | huber/pybotics | l1/lmfit | l1/pybotics) return 1 ;;
    esac
}

if [ $# = 0 ]; then
    set -- 100/25 1000/25 100/33 1000/33
    for kind in box huber l1; do set -- "$@" 28/25/$kind 200/25/$kind; done
fi
printf '%6s %9s %-6s  %-10s %12s %14s %6s  %s\n' poses unknowns kind tool 'time [ms]' 'flexcal/tool' steps 'cost above the least'
for size in "$@"; do
    poses=${size%%/*} rest=${size#*/}
    unknowns=${rest%%/*} kind=plain
    case $rest in */*) kind=${rest#*/} ;; esac
    "$flexcal" write "$poses" "$unknowns" "$kind" "$out/ur10.csv"
    # Five rounds in turn (pybotics one); the best median of each, so that a neighbour's load spoils none.
    for round in 1 2 3 4 5; do
        for tool in flexcal $peers; do
            has "$tool" || continue
            [ "$tool" != pybotics ] || [ $round = 1 ] || continue
            echo "$tool $(fit "$tool")"
        done
    done | awk -v poses="$poses" -v unknowns="$unknowns" -v kind="$kind" '
        !($1 in best) { order[++n] = $1 }
        !($1 in best) || $2 < best[$1] { best[$1] = $2 }
        { cost[$1] = $3; steps[$1] = $4; if (least == "" || $3 < least) least = $3 }
        END {
            for (i = 1; i <= n; ++i) {
                tool = order[i]
                above = cost[tool] < 1e99 ? sprintf("%.1e", cost[tool] / least - 1) : "not done"
                printf "%6d %9d %-6s  %-10s %12.3f %14.5f %6d  %s\n", poses, unknowns, kind, tool, best[tool],
                    best["flexcal"] / best[tool], steps[tool], above
            }
            if (cost["flexcal"] > least * (1 + 1e-8)) { print "flexcal stops above the minimum"; exit 1 }
        }'
done
