//! `--method joints`: the joints of a robot from tests at several postures.

use std::collections::BTreeMap;

use super::answer::{Answer, Figure, OfJoint};
use super::{Args, Error};
use crate::case::Case;
use crate::frf::{MeasurementSettings, measure};
use crate::identify::case_file;
use crate::identify::joints::{JointFit, PostureFrf, fit};
use crate::identify::steady_fit::NINETY_PERCENT;
use crate::recording::Recording;
use crate::structure::{Form, Robot};

/// Postures whose angles are closer than this, degrees, are one.
const SAME_DEG: f64 = 1e-3;

pub(super) fn joints(args: &Args, recordings: &[Recording]) -> Result<Answer, Error> {
    let start = start(args)?;
    let mut postures: Vec<(Vec<f64>, Vec<Recording>)> = Vec::new();
    for recording in recordings {
        let Some(posture) = &recording.sidecar.posture else {
            return Err(Error::input(format!(
                "{}: [posture] joints_deg is needed and not there: joint angles in degrees, from the base on",
                crate::recording::Sidecar::path_of(&recording.path).display()
            )));
        };
        let is_same = |known: &[f64]| {
            let mut pairs = known.iter().zip(&posture.joints_deg);
            known.len() == posture.joints_deg.len() && pairs.all(|(a, b)| (a - b).abs() < SAME_DEG)
        };
        match postures.iter_mut().find(|(known, _)| is_same(known)) {
            Some((_, members)) => members.push(recording.clone()),
            None => postures.push((posture.joints_deg.clone(), vec![recording.clone()])),
        }
    }
    let settings = MeasurementSettings {
        band_hz: match args.band_hz[..] {
            [] => None,
            [low, high] if low < high => Some((low, high)),
            _ => {
                return Err(Error::input(
                    "--band-hz: two frequencies are needed, the lower first, as in 2,60",
                ));
            }
        },
        ..MeasurementSettings::default()
    };
    let mut warnings = Vec::new();
    let mut measured = Vec::new();
    for (joints_deg, members) in &postures {
        let found = measure(members, &settings)?;
        warnings.extend(found.warnings);
        measured.push(PostureFrf {
            angles_rad: joints_deg.iter().map(|angle| angle.to_radians()).collect(),
            table: found.table,
            deviation: found.deviation,
        });
    }
    let fit = fit(&start, &measured, args.payload).map_err(|error| Error::input(error.to_string()))?;
    if fit.misfit > 4.0 {
        warnings.push(format!(
            "what is left is {:.1} times the error of the receptances: geometry or inertia of the links may be wrong, or links bend; the intervals are those of the scatter between receptances",
            fit.misfit.sqrt()
        ));
    }
    answer(args, &fit, postures.len(), warnings)
}

fn start(args: &Args) -> Result<Robot, Error> {
    let Some(path) = &args.start else {
        return Err(Error::input(
            "--method joints needs --start CASE.toml: geometry and inertia of the robot's links, and a guess of its joints",
        ));
    };
    let case = Case::read(path)?;
    match &case.structure()?.form {
        Form::Joints(robot) => Ok((**robot).clone()),
        _ => Err(Error::input(format!(
            "--start {}: structure.kind = \"joints\" is needed",
            path.display()
        ))),
    }
}

fn answer(args: &Args, fit: &JointFit, postures: usize, warnings: Vec<String>) -> Result<Answer, Error> {
    let count = fit.robot.joints.len();
    let mut of_joints: Vec<OfJoint> = (1..=count)
        .map(|joint| OfJoint {
            joint,
            parameters: BTreeMap::new(),
        })
        .collect();
    let mut deviations = vec![[None; 3]; count];
    let mut said = vec![format!(
        "{postures} postures; what is left is {:.2} times the error of the receptances",
        fit.misfit.sqrt()
    )];
    for (index, parameter) in fit.parameters.iter().enumerate() {
        let value = parameter.value(&fit.robot);
        let share = fit.covariance[(index, index)].max(0.0).sqrt();
        // Of the logarithm: the interval is not that of a difference.
        let factor = (NINETY_PERCENT * share).exp();
        let figure = Figure {
            value,
            ci90: [value / factor, value * factor],
        };
        let joint = parameter.joint(count);
        of_joints[joint].parameters.insert(parameter.key(), figure);
        let place = ["stiffness_nm_per_rad", "damping_nms_per_rad", "mass_kg"]
            .iter()
            .position(|key| *key == parameter.key());
        if let Some(place) = place {
            deviations[joint][place] = Some(share * value);
        }
        said.push(format!(
            "joint {} {} = {value:.5e}, 90 % interval {:.5e} to {:.5e}",
            joint + 1,
            parameter.key(),
            figure.ci90[0],
            figure.ci90[1]
        ));
    }
    let name = args
        .out
        .as_deref()
        .and_then(std::path::Path::file_stem)
        .unwrap_or_default()
        .to_string_lossy();
    Ok(Answer {
        fit_error: Some(fit.relative_error),
        misfit: Some(fit.misfit),
        warnings,
        said,
        joints: Some(of_joints),
        table: Some(case_file::robot(&name, &fit.robot, &deviations)),
        ..Answer::of("joints", Vec::new(), Vec::new())
    })
}
