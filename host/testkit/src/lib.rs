//! Support for tests of several crates: the project's cases, the folder of measured recordings, rates that are claimed,
//! and the files of campaign results.
//!
//! A dev-dependency only. It depends on `quietcut-model` and the crates below, so that these cannot use it in their
//! tests.
//!
//! ```
//! let case = quietcut_testkit::case("kuka-kr90-acetal");
//! assert_eq!(case.tool().map(|tool| tool.teeth).ok(), Some(2));
//! ```
#![allow(clippy::expect_used, clippy::panic)]

pub mod rates;
pub mod results;
mod slice;

pub use slice::slice;

use std::path::PathBuf;

use quietcut_model::case::Case;
use quietcut_model::structure::{Form, Robot};

/// The folder `tests/` at the root of the workspace.
pub fn tests_folder() -> PathBuf {
    [env!("CARGO_MANIFEST_DIR"), "..", "..", "tests"].iter().collect()
}

/// Path of the file `name` in the folder of measured recordings, given by the environment variable `QUIETCUT_DATA`.
///
/// A test that uses such a file has `measured` in its name and is `#[ignore]`d, so that it is skipped without the
/// recordings; `tests/run` runs it if they are present.
///
/// # Panics
/// `QUIETCUT_DATA` is not set.
pub fn measured(name: &str) -> PathBuf {
    let folder =
        std::env::var_os("QUIETCUT_DATA").expect("QUIETCUT_DATA names the folder of measured records");
    PathBuf::from(folder).join(name)
}

/// The case `tests/cases/NAME.toml`.
///
/// # Panics
/// There is no such case, or it cannot be read.
pub fn case(name: &str) -> Case {
    let path = tests_folder().join("cases").join(format!("{name}.toml"));
    Case::read(path).expect("a case of the project reads")
}

/// The robot of the case `six-joint-robot`.
///
/// # Panics
/// The case cannot be read, or its structure is not given by joints.
pub fn robot() -> Robot {
    match case("six-joint-robot").structure.expect("a structure").form {
        Form::Joints(robot) => *robot,
        _ => panic!("six-joint-robot has joints"),
    }
}
