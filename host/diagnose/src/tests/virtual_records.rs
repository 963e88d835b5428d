//! Cases and virtual cuts that several tests share.

use std::path::Path;

use quietcut_model::case::Case;
use quietcut_recording::Recording;
use quietcut_simulate::rig::Noise;
use quietcut_simulate::{Recorder, TachometerModel, VirtualCut};

/// The case `name` of the folder `tests/cases`, with the further lines `more`.
pub(crate) fn case(name: &str, more: &str) -> Case {
    let path = format!("{}/../../tests/cases/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).unwrap();
    Case::parse(Path::new(&path), &format!("{text}\n{more}")).unwrap()
}

/// Recording of a cut by ideal sensors and a tachometer without jitter. `noise` is the noise on every channel, as a share of its root mean
/// square.
pub(crate) fn record(
    case: &Case,
    cut: &VirtualCut,
    path: &str,
    rate_hz: f64,
    noise: f64,
    seed: u64,
) -> Recording {
    let tachometer = TachometerModel {
        jitter_s: 0.0,
        ..TachometerModel::ONE_MARK
    };
    let recorder = Recorder::Ideal { rate_hz };
    let (mut recording, _) = cut.record(case, recorder, tachometer, Path::new(path)).unwrap();
    let noise = Noise {
        relative: noise,
        ..Noise::default()
    };
    noise.add(&mut recording, seed);
    recording
}
