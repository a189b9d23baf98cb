//! Other names that people and programs use for the keys and words of flexcal.

/// Names of flexcal without their units, with other names for the same thing. The names that are
/// known at a place decide which one is meant there.
const OTHER_NAMES: [(&[&str], &[&str]); 45] = [
    // Places and rotations.
    (
        &["target", "translation", "xyz", "at", "com"],
        &[
            "position",
            "translation",
            "offset",
            "origin",
            "location",
            "place",
            "pos",
            "xyz",
            "tcp",
            "trans",
            "point",
            "target",
            "tip",
            "t",
            "at",
            "coordinates",
            "vector",
        ],
    ),
    (
        &["rotation", "rpy"],
        &[
            "quaternion",
            "quat",
            "q",
            "orientation",
            "euler",
            "euler_angles",
            "angles",
            "rpy",
            "rot",
            "r",
            "rotvec",
            "rotation_vector",
            "axis_angle",
            "rotation",
            "quat_xyzw",
        ],
    ),
    (&["com"], &["cog", "center_of_mass", "centre_of_mass", "centroid", "center", "centre", "cm"]),
    (
        &["on"],
        &["parent", "carrier", "frame", "link", "mounted_on", "mount", "attached_to", "joint"],
    ),
    (&["parent"], &["on", "parent_joint", "previous", "after"]),
    (&["joint"], &["axis", "number", "index", "j", "id", "joints", "leader", "link", "after"]),
    // Joints and bodies.
    (&["name"], &["id", "label", "beam", "title"]),
    (&["kind"], &["type", "joint_type"]),
    (&["theta"], &["offset", "zero", "home", "th", "q0", "q", "zero_offset", "joint_offset"]),
    (&["d"], &["offset", "link_offset", "r"]),
    (&["a"], &["length", "link_length", "r", "l"]),
    (&["alpha"], &["twist", "link_twist"]),
    (
        &["min", "max"],
        &["bounds", "bound", "limits", "limit", "range", "interval", "minmax", "bracket"],
    ),
    (&["min"], &["lower", "lower_limit", "low", "minimum", "from", "lb", "lower_bound"]),
    (&["max"], &["upper", "upper_limit", "high", "maximum", "to", "ub", "upper_bound"]),
    (&["mass"], &["weight", "payload", "m", "load"]),
    (&["payload"], &["mass", "weight", "load", "gripper"]),
    (&["body"], &["mass", "bodies", "payload", "masses", "inertial"]),
    (&["stiffness"], &["k", "spring", "elasticity", "torsional_stiffness", "spring_constant"]),
    (&["mimic"], &["coupled_to", "follows", "coupling", "gear"]),
    (&["ratio"], &["multiplier", "factor", "gear_ratio", "gear"]),
    (&["dh"], &["convention", "dh_convention", "dh_form", "form"]),
    (&["gravity"], &["g", "gravitation"]),
    // Rules for parameters.
    (
        &["sigma"],
        &[
            "std",
            "stddev",
            "std_dev",
            "sd",
            "prior",
            "uncertainty",
            "tolerance",
            "tol",
            "spread",
            "error",
        ],
    ),
    (&["fixed"], &["hold", "held", "locked", "lock", "frozen", "constant", "const", "fix"]),
    (&["free"], &["vary", "estimate", "identify", "variable", "fit", "fitted", "active"]),
    // Data and tables.
    (
        &["files"],
        &[
            "file",
            "filename",
            "filenames",
            "path",
            "paths",
            "csv",
            "table",
            "tables",
            "measurements",
            "data",
            "source",
        ],
    ),
    (
        &["position_sigma"],
        &[
            "noise",
            "sigma_position",
            "accuracy",
            "std",
            "uncertainty",
            "position_noise",
            "measurement_noise",
            "position_std",
        ],
    ),
    (
        &["held_out"],
        &[
            "holdout",
            "heldout",
            "hold_out",
            "validation",
            "split",
            "test",
            "test_size",
            "validation_split",
        ],
    ),
    (&["seed"], &["random_seed", "random_state", "rng"]),
    (&["fraction"], &["share", "portion", "percent", "percentage", "size", "test_size"]),
    (&["column"], &["split", "columns", "field"]),
    (&["joints"], &["joint_table", "joint_file", "joint_log", "controller", "robot"]),
    (&["by"], &["on", "key", "how", "join", "join_by", "match"]),
    (&["tolerance"], &["max_gap", "window", "max_dt", "slop", "tol"]),
    (&["offset"], &["shift", "delay", "lag", "time_offset", "clock_offset"]),
    (&["delimiter"], &["separator", "sep", "delim", "column_separator", "field_separator"]),
    (&["decimal"], &["decimal_separator", "decimal_point", "decimals", "decimal_mark", "comma"]),
    (&["comment"], &["comments", "comment_char", "comment_mark"]),
    (&["missing"], &["na", "na_values", "nan", "null", "invalid", "no_data"]),
    // Cameras.
    (&["focal"], &["f", "fx", "focal_length", "focallength"]),
    (&["centre"], &["center", "principal_point", "pp", "cx", "c", "optical_center"]),
    (&["image"], &["resolution", "image_size", "size", "width", "imagesize"]),
    (&["distortion"], &["dist", "dist_coeffs", "distortion_coefficients", "coefficients"]),
    (&["loss"], &["kind", "type", "method", "estimator"]),
];

/// Other words for the values of keys.
const OTHER_WORDS: [(&str, &[&str]); 11] = [
    (",", &["comma", "komma", "virgule"]),
    (".", &["point", "dot", "period", "punkt"]),
    (";", &["semicolon", "semikolon"]),
    ("tab", &["\\t", "tabulator", "tabs", "tsv"]),
    ("spaces", &["space", "whitespace", "blank", "blanks"]),
    ("standard", &["denavit-hartenberg", "classic", "classical", "sdh", "distal", "std", "dh"]),
    ("modified", &["mdh", "craig", "proximal", "khalil"]),
    ("revolute", &["continuous", "rotary", "rotational", "hinge", "r", "rot", "revolving"]),
    ("prismatic", &["linear", "slide", "sliding", "translational", "p", "rail", "slider"]),
    ("time", &["timestamp", "timestamps", "date", "clock", "time_s"]),
    ("order", &["row", "rows", "index", "sequence", "line"]),
];

/// Returns the names among `known` that another name of a key means, with the unit of the key if
/// they take it, otherwise with their first unit.
pub(crate) fn other_names<'k>(key: &str, known: &'k [String]) -> Vec<&'k str> {
    let key = key.to_lowercase().replace(['-', ' '], "_");
    let ends = key.match_indices('_').map(|(place, _)| place).rev();
    let mut splits = std::iter::once(key.len()).chain(ends).map(|place| key.split_at(place));
    splits.find_map(|split| meant(split, known)).unwrap_or_default()
}

/// Returns the names that a word with the ending of a unit, such as `_mm`, means; `None` if it
/// means none of those that are `known`.
fn meant<'k>((word, unit): (&str, &str), known: &'k [String]) -> Option<Vec<&'k str>> {
    let groups = OTHER_NAMES.iter().filter(|(_, others)| others.contains(&word));
    let mut names: Vec<&str> = Vec::new();
    for ours in groups.flat_map(|(ours, _)| *ours).filter(|ours| **ours != word) {
        let end = |name: &'k String| name.strip_prefix(ours);
        let with_unit = known.iter().find(|name| end(name) == Some(unit));
        let is_of = |name: &&'k String| end(name).is_some_and(|end| UNITS.contains(&end));
        names.extend(with_unit.or_else(|| known.iter().find(is_of)).map(String::as_str));
    }
    if !unit.is_empty() && names.iter().any(|name| name.ends_with(unit)) {
        names.retain(|name| name.ends_with(unit));
    }
    names.dedup();
    (!names.is_empty()).then_some(names)
}

/// Ends of names with a unit, and of those without one.
const UNITS: [&str; 14] = [
    "",
    "_m",
    "_mm",
    "_deg",
    "_rad",
    "_px",
    "_kg",
    "_s",
    "_N",
    "_C",
    "_m_s2",
    "_N_m_per_rad",
    "_relative",
    "_sigma",
];

/// Returns the word among `known` that another word for it means.
pub(crate) fn other_word<'k>(word: &str, known: &[&'k str]) -> Option<&'k str> {
    let word = word.trim().to_lowercase();
    let is_meant = |ours: &&&str| {
        OTHER_WORDS.iter().any(|(of, others)| of == *ours && others.contains(&word.as_str()))
    };
    known.iter().find(is_meant).copied()
}
