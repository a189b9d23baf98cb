//! Errors in URDF files: exit status 2, a located message, no output.

use crate::common::program::{Folder, assert_contains};

const JOINT: &str =
    "<joint name=\"j\" type=\"revolute\"><parent link=\"a\"/><child link=\"b\"/></joint>";

fn with(links: &str, joints: &str) -> String {
    format!("<robot name=\"r\">\n{links}\n{joints}\n</robot>\n")
}

#[test]
fn mistakes_are_named_with_their_place() {
    let links = "<link name=\"a\"/><link name=\"b\"/>";
    let chain = |attributes: &str, inner: &str| {
        with(
            links,
            &format!(
                "<joint name=\"j\" {attributes}>\n<parent link=\"a\"/><child link=\"b\"/>\n{inner}\n</joint>"
            ),
        )
    };
    let many: Vec<String> = (0..1000).map(|k| format!("<link name=\"l{k}\"/>")).collect();
    let many = many.concat();
    let revolute = |inner: &str| chain("type=\"revolute\"", inner);
    let bomb =
        "<!DOCTYPE r [<!ENTITY a \"aaaa\"><!ENTITY b \"&a;&a;&a;&a;\">]>\n<robot name=\"&b;\"/>";
    let deep = format!("{}{}", "<robot>".repeat(100_000), "</robot>".repeat(100_000));
    let cases: Vec<(&str, String, &str)> = vec![
        ("empty", String::new(), "not valid XML"),
        (
            "cut",
            "<robot name=\"r\">\n<link name=\"a\">".to_owned(),
            ":2: the file ends within <link name=\"a\">: it was cut off; get the whole file again",
        ),
        (
            "cut tag",
            "<robot>\n<joint name=\"ro".to_owned(),
            ":2: the file ends within <joint name=\"ro: it was",
        ),
        (
            "not closed",
            "<robot name=\"r\">\n<!-- <joint> -->\n<joint name=\"a>\">\n<parent/>\n<joint name=\"b\"><child/></joint>\n</robot>".to_owned(),
            ":3: <joint name=\"a>\"> is not closed; write </joint> before </robot> on line 6",
        ),
        ("other", "<sdf/>".to_owned(), ":1: not a URDF: its outermost element is <sdf>"),
        ("mjcf", "<mujoco/>".to_owned(), "mjcf-urdf-simple-converter"),
        ("sdf", "<sdf/>".to_owned(), "sdf2urdf"),
        ("table", "joint,theta,d\n1,0,360\n".to_owned(), "give the table of a data sheet as CSV"),
        ("page", "<!DOCTYPE html>\n<html>".to_owned(), ":1: an HTML page, not a URDF"),
        ("workbook", "PK\u{3}\u{4}".to_owned(), "a ZIP archive or a workbook (XLSX, ODS), not a URDF"),
        ("pdf", "%PDF-1.7".to_owned(), "a PDF document, not a URDF"),
        ("usd", "#usda 1.0\n".to_owned(), ":1: a USD scene, not a URDF"),
        (
            "two rotations",
            revolute("<origin rpy=\"0 0 0\" quat_xyzw=\"0 0 0 1\"/>"),
            ":5: <origin> has both rpy and quat_xyzw",
        ),
        ("quaternion", revolute("<origin quat_xyzw=\"0 0 0 0\"/>"), ":5: quat_xyzw \"0 0 0 0\" is not a rotation"),
        ("bomb", bomb.to_owned(), "document type declaration"),
        ("deep", deep, "there are no links"),
        ("large", format!("<robot name=\"r\">{}</robot>", " ".repeat(10 << 20)), "larger than 4 MiB"),
        (
            "xacro",
            "<robot name=\"r\" xmlns:xacro=\"http://www.ros.org/wiki/xacro\">\n<xacro:arm/></robot>".to_owned(),
            ":2: a xacro",
        ),
        ("no links", "<robot name=\"r\"/>".to_owned(), "there are no links"),
        ("missing link", with("<link name=\"a\"/>", JOINT), ":3: no link is called \"b\"; the links are a"),
        (
            "no child",
            with(links, "<joint name=\"j\" type=\"fixed\"><parent link=\"a\"/></joint>"),
            "<joint> has no element <child>",
        ),
        ("two links", with("<link name=\"a\"/>\n<link name=\"a\"/>", ""), ":3: another link is called \"a\""),
        ("no name", with("<link/>", ""), "<link> has no attribute name"),
        ("type", chain("type=\"floating\"", ""), ":3: a joint of type \"floating\""),
        ("no type", chain("", ""), "<joint> has no attribute type"),
        ("axis", revolute("<axis xyz=\"0 0 0\"/>"), ":5: the axis has no direction"),
        ("axis word", revolute("<axis xyz=\"z\"/>"), ":5: \"z\" is not 3 finite numbers"),
        (
            "commas",
            revolute("<origin xyz=\"0,0,0.22\"/>"),
            "is not 3 finite numbers; separate numbers by spaces alone: \"0 0 0.22\"",
        ),
        (
            "decimal commas",
            revolute("<origin xyz=\"0 0 0,22\"/>"),
            "write decimal points: \"0 0 0.22\"",
        ),
        ("unit", revolute("<origin xyz=\"0 0 1m\"/>"), "write metres and radians, without units"),
        ("nan", revolute("<origin xyz=\"0 nan 0\"/>"), ":5: \"0 nan 0\" is not 3 finite numbers"),
        ("huge", revolute("<origin rpy=\"1e300 0 0\"/>"), ":5: \"1e300 0 0\" is not 3 finite"),
        (
            "mass",
            with("<link name=\"a\"><inertial>\n<mass value=\"-1\"/></inertial></link><link name=\"b\"/>", JOINT),
            ":3: a mass of -1 kg is negative",
        ),
        ("mimic", revolute("<mimic joint=\"k\"/>"), ":5: no joint is called \"k\""),
        ("mimic itself", revolute("<mimic joint=\"j\"/>"), "follow each other in a cycle"),
        (
            "two parents",
            with(
                &format!("{links}<link name=\"c\"/>"),
                &format!("{JOINT}\n<joint name=\"k\" type=\"fixed\"><parent link=\"c\"/><child link=\"b\"/></joint>"),
            ),
            ":4: link \"b\" is the child of two joints, \"j\" and \"k\"",
        ),
        (
            "loop",
            with(
                links,
                &format!("{JOINT}\n<joint name=\"k\" type=\"fixed\"><parent link=\"b\"/><child link=\"a\"/></joint>"),
            ),
            "the joints form a loop",
        ),
        ("many roots", with(&many, ""), "l29 and 970 more; choose one with --base"),
        ("roots", with(&format!("{links}<link name=\"c\"/>"), JOINT), "several links have no parent: a, c"),
        ("nothing moves", chain("type=\"fixed\"", ""), "no joint moves between \"a\" and \"b\""),
    ];
    for (name, text, says) in cases {
        let folder = Folder::with([("arm.urdf", &text)]);
        let run = folder.flexcal("init arm.urdf --out out").code(2);
        assert_contains(&run.stderr, &["arm.urdf", says]);
        assert!(!folder.has("out"), "{name}");
    }
}
