//! Small arms with every input that commands read, whose fit is fast.

/// File names with their texts.
pub type Texts = Vec<(&'static str, Vec<u8>)>;

const RIGID: &str = "name = \"arm\"\ntitle = \"Two joints and a slide\"\n[[joint]]\nd_m = 0.3\nmin_deg = -170\nmax_deg = 170\n\
    [[joint]]\nalpha_deg = 90\na_m = 0.1\nmin_deg = -100\nmax_deg = 100\n[[joint]]\nkind = \"prismatic\"\nalpha_deg = 90\nmin_m = 0.1\nmax_m = 0.6\n\
    [tool]\ntarget_m = [0.2, 0, 0.05]\n[base]\ntranslation_m = [1, 0, 0]\n\
    [[effect]]\ngear-ratio = { joint = 2 }\n[parameters]\n\"joint*.theta\" = { sigma_deg = 1 }\n\"joint*.a\" = { sigma_mm = 3, min_mm = -9 }\n\
    \"tool.x\" = { sigma_mm = 3 }\n\"base.*\" = { free = true }\n\"joint1.*\" = { fixed = true }\n[data]\nfiles = [\"rows.csv\"]\n\
    position_sigma_mm = 0.1\nreference_temperature_C = 20\nheld_out = { fraction = 0.3, seed = 1 }\n";

const ELASTIC: &str = "name = \"bent\"\n[statics]\nequilibrium = \"deflected\"\nbeam_elements = 1\n[[joint]]\nd_m = 0.2\n[[joint]]\nalpha_deg = 90\n\
    stiffness_N_m_per_rad = 2e4\n[[joint]]\na_m = 0.9\nstiffness_N_m_per_rad = 9e3\n[joint.beam]\nname = \"A\"\nmass_kg = 3\nEA_N = 1e7\nEIy_N_m2 = 9e3\n\
    EIz_N_m2 = 9e3\nGJ_N_m2 = 7e3\n[[joint.beam.mass]]\nmass_kg = 0.5\nat_m = [0.4, 0, 0.05]\n[joint.beam.hoist]\nat_m = [0.5, 0, 0]\nforce_N = 20\n\
    [[joint.body]]\nmass_kg = 2\ncom_m = [0.1, 0, 0]\n[tool]\ntarget_m = [0.2, 0, -0.1]\npayload_kg = 1\n[robust]\nloss = \"huber\"\n\
    [parameters]\n\"joint*.theta\" = { sigma_deg = 1 }\n\"joint*.stiffness\" = { sigma_relative = 0.5, min_relative = 0.2 }\n\"A.*\" = { sigma_relative = 0.5 }\n\
    \"tool.*\" = { sigma_mm = 5 }\n[[constraint]]\nterms = { \"joint2.stiffness\" = 1.0, \"joint3.stiffness\" = -1.0 }\nat_least = 0.0\n\
    [data]\nfiles = [\"rows.csv\"]\nposition_sigma_mm = 0.1\nreference_temperature_C = 20\nheld_out = { column = \"split\" }\n";

const RIGID_TRUTH: &str = "[parameters]\n\"joint2.theta\" = { deg = 0.2 }\n\"base.x\" = { mm = 30 }\n[random]\n\"joint*.a\" = { sigma_mm = 1 }\n\
    [[effect]]\ngear-ratio = { joint = 2 }\nerror_relative = 1e-3\n[noise]\nposition_sigma_mm = 0.1\n[poses]\nq1_deg = [-90, 90]\nq2_deg = [-60, 60]\n\
    q3_m = [0.1, 0.5]\ntemperature_C = [17, 31]\ntime_step_s = [10, 20]\nheld_out = 0.4\n";

const ELASTIC_TRUTH: &str = "[random]\n\"*\" = { sigma_deg = 0.1, sigma_mm = 1, sigma_relative = 0.1 }\n[[effect]]\njoint-harmonic = { joint = 2, orders = [1] }\n\
    sin1_deg = 0.02\n[noise]\nposition_sigma_mm = 0.1\n[poses]\nq1_deg = [-90, 90]\nq2_deg = [-20, 60]\nq3_deg = [-90, 0]\npayload_kg = [0, 1, 2]\n\
    hoist_N = [15, 25]\napproach = false\nidentification = 24\n[rig]\nsegments = 4\n";

const STUDY: &str = "name = \"study\"\nproblem = \"problem.toml\"\nseed = 7\nrepetitions = 3\nposition_sigma_mm = [0.1]\nidentification_poses = [9]\n\
    held_out_poses = 5\nstrategies = [\"joint\"]\nsolvers = [\"auto\"]\n";

const TARGETS: [&str; 2] = [
    "q1_deg,q2_deg,q3_m,x_mm,y_mm,z_mm\n10,20,0.3,1400,50,200\n-40,30,0.4,1300,-250,250\n",
    "q1_deg,q2_deg,q3_deg,x_mm,y_mm,z_mm,payload_kg\n10,20,-30,1060,190,250,1\n-40,30,-60,900,-700,200,0\n",
];

/// Returns the input files of an arm, without measurements and estimate, which commands make.
pub fn texts(elastic: bool) -> Texts {
    let (problem, truth) = if elastic { (ELASTIC, ELASTIC_TRUTH) } else { (RIGID, RIGID_TRUTH) };
    let poses = &truth[truth.find("[poses]").unwrap()..];
    let poses = poses
        .lines()
        .filter(|line| !line.contains("held_out") && !line.contains("identification"))
        .map(|line| format!("{line}\n"))
        .collect::<Vec<_>>()
        .concat();
    let owned = |text: &str| text.as_bytes().to_vec();
    vec![
        ("problem.toml", owned(problem)),
        ("TRUTH.toml", owned(truth)),
        ("STUDY.toml", owned(&format!("{STUDY}{poses}"))),
        ("targets.csv", owned(TARGETS[usize::from(elastic)])),
    ]
}
