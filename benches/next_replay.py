"""Replays `flexcal next` on a measured pool of poses with the real commands, against random sets.

Usage: next_replay.py FLEXCAL PROBLEM.toml POOL.csv [STARTS] [TOLERANCE_MM ...]

PROBLEM.toml declares the arm with files = ["pool.csv"] and held_out = "none" in [data]. POOL.csv holds the measured pool. Eight random
poses are given; `next` chooses the others, and `identify` and `predict` give the error over the rest of the pool. Prints the mean
error [mm] for increasing numbers of poses, and for each tolerance how often "enough" is right and how late it comes.
"""

import csv
import json
import math
import random
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

COUNTS = [8, 10, 12, 14, 16, 18, 20, 24, 30, 36, 42, 50, 62, 75, 100]
"""Numbers of poses at which the error is evaluated."""
SHOWN = [10, 12, 16, 20, 30, 42, 50, 75, 100]
"""Numbers of poses that are printed."""
GIVEN = 8
"""Number of random poses that are measured before the first choice."""
LEVEL = 0.95
"""Share of the pool that the bound covers."""


class Pool:
    """Measured poses, and the folder in which the program works on them."""

    def __init__(self, program: str, problem: Path, table: Path, folder: Path) -> None:
        self.program, self.folder = program, folder
        with table.open() as file:
            self.header, *self.rows = csv.reader(file)
        joints = [k for k, name in enumerate(self.header) if name[0] == "q" and name[1].isdigit()]
        in_degrees = [57.29577951308232 if self.header[k].endswith("_rad") else 1.0 for k in joints]
        self.commands = [[float(row[k]) * unit for k, unit in zip(joints, in_degrees)] for row in self.rows]
        (folder / "problem.toml").write_text(problem.read_text())
        self.write("pool.csv", range(len(self.rows)))

    def write(self, name: str, rows) -> None:
        with (self.folder / name).open("w") as file:
            writer = csv.writer(file)
            writer.writerow(self.header)
            writer.writerows(self.rows[row] for row in rows)

    def run(self, *arguments: str) -> dict:
        command = [self.program, *arguments, "--json", "--force", "--out", "out"]
        done = subprocess.run(command, capture_output=True, text=True, cwd=self.folder)
        if done.returncode not in (0, 1):
            raise SystemExit(done.stderr)
        return json.loads(done.stdout)

    def errors(self, chosen: list[int]) -> tuple[float, float]:
        """Returns mean and 95 % quantile of the errors over the other rows after a fit to the chosen ones [mm]."""
        measured = set(chosen)
        self.write("measured.csv", chosen)
        self.write("rest.csv", [row for row in range(len(self.rows)) if row not in measured])
        self.run("identify", ".", "--data", "measured.csv")
        self.run("predict", ".", "--estimate", "out/estimate.json", "--data", "rest.csv")
        with (self.folder / "out" / "residuals.csv").open() as file:
            axes = [f"residual_{axis}_mm" for axis in "xyz"]
            lengths = sorted(math.hypot(*(float(line[axis]) for axis in axes)) for line in csv.DictReader(file))
        return statistics.mean(lengths), lengths[int(LEVEL * len(lengths))]

    def next(self, chosen: list[int], count: int) -> tuple[list[int], float]:
        """Returns the rows that `next` chooses, and the bound before they are measured [mm]; infinite without one."""
        self.write("measured.csv", chosen)
        asked = ["next", ".", "--data", "measured.csv", "--pool", "pool.csv", "--poses", str(count)]
        found = self.run(*asked)
        bound = found["now"]["bound_mm"] if found["now"] else math.inf
        if not found["poses"]:
            return [], bound
        with (self.folder / "out" / "next.csv").open() as file:
            return [self.row(line) for line in csv.DictReader(file)], bound

    def row(self, line: dict[str, str]) -> int:
        """Returns the row of the pool with the commands of a line of next.csv."""
        names = [name for name in line if name[0] == "q" and name[1].isdigit()]
        wanted = [float(line[name]) * (57.29577951308232 if name.endswith("_rad") else 1.0) for name in names]
        distance = lambda row: sum(abs(a - b) for a, b in zip(self.commands[row], wanted))
        return min(range(len(self.rows)), key=distance)

    def replay(self, drawn: list[int]) -> list[tuple[float, float, float]]:
        """Returns mean error, 95 % quantile and bound at each number of poses. Where `next` stops, random poses follow."""
        chosen, found = drawn[:GIVEN], []
        for count, after in zip(COUNTS, [*COUNTS[1:], COUNTS[-1] + 1]):
            errors = self.errors(chosen)
            added, bound = self.next(chosen, after - count)
            found.append((*errors, bound))
            chosen = chosen + added
            left = [row for row in drawn if row not in chosen]
            chosen = chosen + left[: max(0, after - len(chosen))]
        return found


def main() -> None:
    program, problem, table = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3])
    starts = int(sys.argv[4]) if len(sys.argv) > 4 else 20
    tolerances = [float(word) for word in sys.argv[5:]]
    with tempfile.TemporaryDirectory() as folder:
        pool = Pool(str(Path(program).resolve()), problem, table, Path(folder))
        drawn = [random.Random(seed).sample(range(len(pool.rows)), COUNTS[-1]) for seed in range(starts)]
        replays = [pool.replay(rows) for rows in drawn]
        by_chance = [[pool.errors(rows[:count])[0] for count in SHOWN] for rows in drawn]
    columns = list(zip(*by_chance))
    places = [COUNTS.index(count) for count in SHOWN]
    ratios = [[replay[k][2] / replay[k][1] for replay in replays] for k in places]
    print("poses      ", *(f"{count:7}" for count in SHOWN))
    print("random mean", *(f"{statistics.mean(column):7.4f}" for column in columns))
    print("random best", *(f"{min(column):7.4f}" for column in columns))
    print("next       ", *(f"{statistics.mean(replay[k][0] for replay in replays):7.4f}" for k in places))
    print("bound holds", *(f"{sum(ratio >= 1 for ratio in of) / starts:7.0%}" for of in ratios))
    print("bound ratio", *(f"{statistics.median(of):7.2f}" for of in ratios))
    for tolerance in tolerances:
        judge(tolerance, replays)


def judge(tolerance: float, replays: list[list[tuple[float, float, float]]]) -> None:
    """Prints how often "enough" is right, and its number of poses as a multiple of the least one that would do."""
    said, right, late = 0, 0, []
    for replay in replays:
        first = next((k for k, (_, _, bound) in enumerate(replay) if bound <= tolerance), None)
        least = next((k for k, (_, quantile, _) in enumerate(replay) if quantile <= tolerance), None)
        if first is not None:
            said, right = said + 1, right + (replay[first][1] <= tolerance)
        late.append(math.inf if first is None or least is None else COUNTS[first] / COUNTS[least])
    median, in_time = statistics.median(late), sum(ratio <= 1.5 for ratio in late)
    print(
        f"enough at {tolerance:.2f} mm: said in {said} of {len(replays)}, right in {right}; "
        f"poses / least number: median {median:.2f}, up to 1.5 in {in_time}"
    )


if __name__ == "__main__":
    main()
