"""Public URDFs through flexcal's init and export, against pinocchio in 100 configurations each.

    public.py FLEXCAL FOLDER [FILE#TIP#BASE ...]

init: the pose of the tip, reckoned here from problem.toml as docs/problem.md says, is that of the URDF (with right angles that
the file rounds put in, as init says it takes them). export: identified from simulated measurements with everything free, the
exported URDF has the pose of the tip of the identified arm, and no line has changed but those of <origin>s.
"""

import json
import math
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pinocchio as pin

FLEXCAL, FOLDER = sys.argv[1], Path(sys.argv[2])
ARMS = [
    ("panda_description/urdf/panda.urdf", "panda_hand", None),
    ("ur_description/urdf/ur10_robot.urdf", "tool0", None),
    ("ur_description/urdf/ur5_robot.urdf", "ee_link", None),
    ("kinova_description/robots/kinova.urdf", "j2s6s200_end_effector", None),
    ("xarm_description/urdf/xarm7.urdf", None, None),
    ("z1_description/urdf/z1.urdf", "gripperStator", None),
    ("so_arm_description/urdf/so101.urdf", "gripper_frame_link", None),
    ("baxter_description/urdf/baxter.urdf", "left_gripper", "base"),
    ("tiago_description/robots/tiago.urdf", "wrist_ft_tool_link", "base_link"),
    ("pr2_description/urdf/pr2.urdf", "l_gripper_tool_frame", "base_link"),
]
WORST = 1e-9


def flexcal(*words):
    run = subprocess.run([FLEXCAL, *map(str, words)], capture_output=True, text=True)
    # 1: the fit is not to be trusted; what is exported is the estimate all the same.
    assert run.returncode in (0, 1), (words, run.stderr)


def pose(rotation=np.eye(3), translation=(0, 0, 0)):
    return pin.SE3(rotation, np.array(translation, float))


def about(axis, angle):
    return pose(pin.exp3(np.eye(3)[axis] * angle))


def along(axis, distance):
    return pose(translation=np.eye(3)[axis] * distance)


def tip(joints, q):
    """The last frame of the joints of a problem.toml, q by index."""
    frame = pin.SE3.Identity()
    for k, joint in enumerate(joints):
        if "xyz_m" in joint:
            frame *= pose(pin.rpy.rpyToMatrix(*np.radians(joint["rpy_deg"])), joint["xyz_m"])
            continue
        turns = joint.get("kind", "revolute") == "revolute"
        theta, d = math.radians(joint.get("theta_deg", 0)) + q.get(k, 0) * turns, joint.get("d_m", 0) + q.get(k, 0) * (not turns)
        frame *= about(0, math.radians(joint.get("alpha_deg", 0))) * along(0, joint.get("a_m", 0))
        frame *= about(2, theta) * along(2, d) * about(1, math.radians(joint.get("beta_deg", 0)))
    return frame


def compare(joints, ends, model):
    """Largest distance [m] and angle [rad] between the tips of a problem's joints and of a model."""
    random, data = np.random.default_rng(0), model.createData()
    worst = np.zeros(2)
    for _ in range(100):
        q, at = {}, pin.neutral(model)
        for k, joint in enumerate(joints):
            if joint.get("kind") == "fixed":
                continue
            q[k] = random.uniform(-0.5, 0.5) if joint.get("kind") == "prismatic" else random.uniform(-3, 3)
            own = model.joints[model.getJointId(joint["name"])]
            at[own.idx_q : own.idx_q + own.nq] = q[k] if own.nq == 1 else [math.cos(q[k]), math.sin(q[k])]
        pin.framesForwardKinematics(model, data, at)
        base, end = (data.oMf[model.getFrameId(ends[name], pin.FrameType.BODY)] for name in ("base", "tip"))
        off = (base.inverse() * end).inverse() * tip(joints, q)
        worst = np.maximum(worst, [np.linalg.norm(off.translation), np.linalg.norm(pin.log3(off.rotation))])
    return worst


def right_angles(text):
    """The text with the angles that init takes as rounded: multiples of 90°, or of 45° with four decimals, up to five."""
    def meant(word):
        digits = re.fullmatch(r"-?\d+\.(\d{2,5})", word)
        unit = math.pi / 2 if digits and len(digits[1]) < 4 else math.pi / 4
        near = round(float(word) / unit) * unit if digits else 0
        last = 10.0 ** -len(digits[1]) if digits else 0
        cut = abs(near) - abs(float(word)) if digits else 1
        return repr(near) if near and (abs(cut) <= 0.5 * last or 0 <= cut < last) else word
    whole = lambda match: match[1] + " ".join(map(meant, match[2].split())) + match[3]
    return re.sub(r"(<origin[^>]*rpy=\")([^\"]*)(\")", whole, text)


def numbers(joints, estimate):
    """The joints with their identified numbers."""
    scale = {"mm": 1e-3, "m": 1, "°": 1, "deg": 1, "rad": 180 / math.pi}
    found = {own["name"]: own["estimate"] * scale.get(own["unit"], 1) for own in estimate["parameters"]}
    for k, joint in enumerate(joints):
        own = lambda name: found[f"joint{k + 1}.{name}"]
        if "xyz_m" in joint:
            joint["xyz_m"], joint["rpy_deg"] = [own(f) for f in "xyz"], [own(f) for f in ("roll", "pitch", "yaw")]
        else:
            joint |= {"alpha_deg": own("alpha"), "a_m": own("a"), "theta_deg": own("theta"), "d_m": own("d")}
            joint["beta_deg"] = found.get(f"joint{k + 1}.beta", 0)
    return joints


def main():
    share = Path(pin.__file__).parents[4] / "share/example-robot-data/robots"
    arms = [(share / file, tip, base) for file, tip, base in ARMS]
    arms += [tuple((own.split("#") + [None, None])[:3]) for own in sys.argv[3:]]
    for number, (urdf, end, base) in enumerate(arms):
        folder, urdf = FOLDER / str(number), Path(urdf)
        flexcal("init", urdf, "--out", folder, "--quiet", *(["--tip", end] if end else []), *(["--base", base] if base else []))
        text = (folder / "problem.toml").read_text()
        problem = tomllib.loads(text)
        joints, ends = problem["joint"], problem["urdf"]
        meant = folder / "meant.urdf"
        meant.write_text(right_angles(urdf.read_text()))
        before = compare(joints, ends, pin.buildModelFromUrdf(str(meant)))
        # Every number free; behind the last axis only where an origin is left to take it.
        last = "" if joints[-1].get("kind") == "fixed" else f'"joint{len(joints)}.beta" = {{ fixed = true }}\n'
        rules = f'[parameters]\n"joint*.*" = {{ sigma_deg = 0.1, sigma_mm = 0.3 }}\n"base.*" = {{ free = true }}\n{last}\n'
        every = folder / "every.toml"
        every.write_text(re.sub(r"\[parameters\].*?(?=\[data\])", lambda _: rules, text, flags=re.S))
        ranges = [
            f"q{k + 1}_m = [-0.2, 0.2]\n" if joint.get("kind") == "prismatic" else f"q{k + 1}_deg = [-120, 120]\n"
            for k, joint in enumerate(joints)
            if joint.get("kind") != "fixed"
        ]
        truth = folder / "TRUTH.toml"
        truth.write_text('[random]\n"joint*.*" = { sigma_deg = 0.1, sigma_mm = 0.3 }\n[poses]\n' + "".join(ranges))
        data = folder / "rig" / "measurements.csv"
        flexcal("simulate", every, "--truth", truth, "--poses", 120, "--seed", 1, "--out", data.parent, "--quiet")
        flexcal("identify", every, "--data", data, "--out", folder / "identified", "--quiet")
        estimate, moved = folder / "identified" / "estimate.json", folder / "moved.urdf"
        flexcal("export", every, "--estimate", estimate, "--urdf", urdf, "--out", moved, "--data", data, "--quiet")
        after = compare(numbers(joints, json.loads(estimate.read_text())), ends, pin.buildModelFromUrdf(str(moved)))
        lines = list(zip(urdf.read_text().splitlines(), moved.read_text().splitlines(), strict=True))
        other = [old for old, new in lines if old != new and "<origin" not in old]
        print(f"{urdf.name}: {len(joints)} joints, init {before.max():.1e}, export {after.max():.1e}, {sum(a != b for a, b in lines)} lines moved")
        assert before.max() < WORST and after.max() < WORST and not other, (urdf, before, after, other)


main()
