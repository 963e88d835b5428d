//! `--method joints`: stiffness and damping of robot joints from tests at several postures.

use std::collections::BTreeMap;

use clap::ValueEnum;

use super::Error;
use super::answer::{EstimatedJoint, IdentifyOutput};
use super::args::Args;
use super::figure::Figure;
use super::methods::settling;
use super::written;
use crate::case::Case;
use crate::criteria::{DIFFERENT_LEVELS, LARGEST_JOINT_MISFIT, SAME_POSTURE_DEG};
use crate::frf::{MeasurementSettings, measure};
use crate::identify::case_file;
use crate::identify::cubic_joints::{self, PostureDwells};
use crate::identify::dwell::Dwell;
use crate::identify::joints::{self, JointParameter, PostureFrf};
use crate::identify::law::NonlinearTerm;
use crate::identify::steady::{Settling, steady};
use crate::recording::{Recording, TestKind};
use crate::report::digits::significant;
use crate::structure::{Direction, Form, Robot, Structure};
use quietcut_numerics::statistics::NINETY_PERCENT;

/// Joint angles of one posture of the robot, from its first recording, with all recordings made there.
struct AtPosture {
    joints_deg: Vec<f64>,
    recordings: Vec<Recording>,
}

impl AtPosture {
    fn angles_rad(&self) -> Vec<f64> {
        self.joints_deg.iter().map(|angle| angle.to_radians()).collect()
    }
}

struct JointFit {
    robot: Robot,
    estimates: Vec<(JointParameter, Figure, f64)>,
    misfit: f64,
    relative_error: f64,
    messages: Vec<String>,
    warnings: Vec<String>,
}

pub(super) fn joints(args: &Args, recordings: &[Recording]) -> Result<IdentifyOutput, Error> {
    let start = start(args)?;
    let postures = postures(recordings)?;
    let all_steps = recordings
        .iter()
        .all(|recording| recording.sidecar.kind == Some(TestKind::StepSine));
    let tones = if all_steps {
        dwells(args, &postures, settling(args))
    } else {
        Vec::new()
    };
    let found = if tones.iter().any(|(posture, _)| has_levels(&posture.dwells)) {
        from_tones(args, &start, &postures, tones)?
    } else {
        from_receptances(args, &start, &postures)?
    };
    Ok(answer(args, &found, postures.len()))
}

fn postures(recordings: &[Recording]) -> Result<Vec<AtPosture>, Error> {
    let mut postures: Vec<AtPosture> = Vec::new();
    for recording in recordings {
        let Some(posture) = &recording.sidecar.posture else {
            return Err(Error::input(format!(
                "{}: [posture] joints_deg is missing: joint angles in degrees, starting at the base",
                crate::recording::Sidecar::path_of(&recording.path).display()
            )));
        };
        let is_same = |known: &[f64]| {
            let mut pairs = known.iter().zip(&posture.joints_deg);
            known.len() == posture.joints_deg.len() && pairs.all(|(a, b)| (a - b).abs() < SAME_POSTURE_DEG)
        };
        match postures.iter_mut().find(|known| is_same(&known.joints_deg)) {
            Some(known) => known.recordings.push(recording.clone()),
            None => postures.push(AtPosture {
                joints_deg: posture.joints_deg.clone(),
                recordings: vec![recording.clone()],
            }),
        }
    }
    Ok(postures)
}

/// For each of `postures`, in their order: the steady sine responses, and warnings, such as of dwells that are left
/// out.
fn dwells(args: &Args, postures: &[AtPosture], settling: Settling) -> Vec<(PostureDwells, Vec<String>)> {
    postures
        .iter()
        .map(|posture| {
            let taken = steady(&posture.recordings, usize::from(args.harmonics), settling);
            let dwells = PostureDwells {
                angles_rad: posture.angles_rad(),
                dwells: taken.dwells,
            };
            (dwells, taken.warnings)
        })
        .collect()
}

/// Whether two of the steady responses `dwells` have forces in the same direction whose amplitudes differ by more than
/// the factor [`DIFFERENT_LEVELS`].
fn has_levels(dwells: &[Dwell]) -> bool {
    let forces: Vec<(Direction, f64)> = dwells
        .iter()
        .filter_map(|dwell| dwell.force())
        .map(|line| (line.direction, line.amplitude(1)))
        .collect();
    forces.iter().any(|(direction, force)| {
        let mut others = forces.iter().filter(|(other, _)| other == direction);
        others.any(|(_, other)| *other > DIFFERENT_LEVELS * force)
    })
}

/// Identifies stiffness, damping and the cubic terms of `--terms` of robot joints from steady sine responses at several
/// force levels.
fn from_tones(
    args: &Args,
    start: &Robot,
    postures: &[AtPosture],
    tones: Vec<(PostureDwells, Vec<String>)>,
) -> Result<JointFit, Error> {
    if let Some(other) = args
        .terms
        .iter()
        .find(|term| !matches!(term, NonlinearTerm::CubicStiffness | NonlinearTerm::CubicDamping))
    {
        let name = other.to_possible_value();
        return Err(Error::input(format!(
            "--terms {}: the terms of joints are cubic-stiffness and cubic-damping",
            name.as_ref().map_or("", |name| name.get_name())
        )));
    }
    let fitted = |tones: Vec<(PostureDwells, Vec<String>)>| {
        let (dwells, warnings): (Vec<PostureDwells>, Vec<Vec<String>>) = tones.into_iter().unzip();
        let harmonics = usize::from(args.harmonics);
        cubic_joints::fit(start, &dwells, &args.terms, args.payload, harmonics)
            .map(|fit| (fit, warnings.concat()))
            .map_err(|error| Error::input(error.to_string()))
    };
    let (mut fit, mut warnings) = fitted(tones)?;
    if args.settle_s.is_none() {
        let decay = slowest_decay(&fit.robot, postures)?;
        (fit, warnings) = fitted(dwells(args, postures, Settling::Decay(decay)))?;
    }
    if fit.robust {
        warnings.push(format!(
            "the residual exceeds the noise by a factor of {:.1}: geometry or inertia of the links may be wrong, links may bend, or joints may have other terms; the intervals are estimated from the scatter between steady responses",
            fit.misfit.sqrt()
        ));
    }
    let estimates = fit.parameters.iter().enumerate().map(|(index, parameter)| {
        let deviation = fit.covariance[(index, index)].max(0.0).sqrt();
        let figure = Figure::new(parameter.value(&fit.robot), deviation);
        (*parameter, figure, deviation)
    });
    Ok(JointFit {
        estimates: estimates.collect(),
        misfit: fit.misfit,
        relative_error: fit.relative_error,
        messages: vec!["steady tones at several forces, by harmonic balance".into()],
        warnings,
        robot: fit.robot,
    })
}

/// Smallest decay rate ζω of the modes of the robot over all postures, 1/s, but at least 0.001 1/s.
fn slowest_decay(robot: &Robot, postures: &[AtPosture]) -> Result<f64, Error> {
    let mut slowest = f64::INFINITY;
    for posture in postures {
        let structure = Structure {
            directions: vec![Direction::X, Direction::Y, Direction::Z],
            form: Form::Joints(Box::new(robot.at(&posture.angles_rad()))),
        };
        let first_order = structure
            .first_order()
            .map_err(|error| Error::input(error.to_string()))?;
        slowest = first_order
            .poles()
            .iter()
            .map(|pole| -pole.re)
            .fold(slowest, f64::min);
    }
    Ok(slowest.max(1e-3))
}

/// Identifies stiffness and damping of robot joints from receptances at several postures.
fn from_receptances(args: &Args, start: &Robot, postures: &[AtPosture]) -> Result<JointFit, Error> {
    let settings = MeasurementSettings {
        band_hz: args.band_hz.map(|[low, high]| (low, high)),
        ..MeasurementSettings::default()
    };
    let mut warnings = Vec::new();
    let mut measured = Vec::new();
    for posture in postures {
        let found = measure(&posture.recordings, &settings)?;
        warnings.extend(found.warnings);
        measured.push(PostureFrf {
            angles_rad: posture.angles_rad(),
            table: found.table,
            deviation: found.deviation,
        });
    }
    let fit = joints::fit(start, &measured, args.payload).map_err(|error| Error::input(error.to_string()))?;
    if fit.misfit > LARGEST_JOINT_MISFIT {
        warnings.push(format!(
            "the residual exceeds the error of the receptances by a factor of {:.1}: geometry or inertia of the links may be wrong, or links may bend; the intervals are estimated from the scatter between receptances",
            fit.misfit.sqrt()
        ));
    }
    let estimates = fit.parameters.iter().enumerate().map(|(index, parameter)| {
        let value = parameter.value(&fit.robot);
        let share = fit.covariance[(index, index)].max(0.0).sqrt();
        // `share` is the standard deviation of the logarithm of the parameter, so the 90 % interval of the parameter is
        // value/factor to value·factor.
        let factor = (NINETY_PERCENT * share).exp();
        let figure = Figure {
            value,
            ci90: [value / factor, value * factor],
        };
        (*parameter, figure, share * value)
    });
    Ok(JointFit {
        estimates: estimates.collect(),
        misfit: fit.misfit,
        relative_error: fit.relative_error,
        messages: vec![
            "receptances, without cubic terms: those need step-sine tests at several forces".into(),
        ],
        warnings,
        robot: fit.robot,
    })
}

fn start(args: &Args) -> Result<Robot, Error> {
    let Some(path) = &args.start else {
        return Err(Error::input(
            "--method joints needs --start CASE.toml: geometry and inertia of the robot links, and initial values of its joints",
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

fn answer(args: &Args, found: &JointFit, postures: usize) -> IdentifyOutput {
    let count = found.robot.joints.len();
    let mut of_joints: Vec<EstimatedJoint> = (1..=count)
        .map(|joint| EstimatedJoint {
            joint,
            parameters: BTreeMap::new(),
        })
        .collect();
    let mut messages = vec![format!(
        "{postures} postures; residual divided by the measurement error: {:.2}",
        found.misfit.sqrt()
    )];
    messages.extend(found.messages.iter().cloned());
    for (parameter, figure, _) in &found.estimates {
        let joint = parameter.joint(count);
        of_joints[joint].parameters.insert(parameter.key(), *figure);
        messages.push(format!(
            "joint {} {} = {}, 90 % interval {} to {}",
            joint + 1,
            parameter.key(),
            significant(figure.value, 6),
            significant(figure.ci90[0], 6),
            significant(figure.ci90[1], 6)
        ));
    }
    let deviations: Vec<(JointParameter, f64)> = found
        .estimates
        .iter()
        .map(|(parameter, _, deviation)| (*parameter, *deviation))
        .collect();
    let name = written::case_file(&args.out)
        .and_then(std::path::Path::file_stem)
        .unwrap_or_default()
        .to_string_lossy();
    IdentifyOutput {
        fit_error: Some(found.relative_error),
        misfit: Some(found.misfit),
        warnings: found.warnings.clone(),
        messages,
        joints: Some(of_joints),
        table: Some(case_file::robot(&name, &found.robot, &deviations)),
        ..IdentifyOutput::of("joints", Vec::new(), Vec::new())
    }
}
