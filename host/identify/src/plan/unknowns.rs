//! The unknowns of a plan: independent normal variables, each in units of its prior standard deviation.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};
use quietcut_numerics::eigenvalues::{EigenvalueError, of_symmetric_pencil};

use super::means::Means;
use quietcut_model::case::{Case, Deviation, Parameter};
use quietcut_model::structure::{Form, Joint, Matrices, Mode};
use quietcut_stability::Variable;

/// Relative standard deviations of the uncertain parameters that a plan assumes for a case that states none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior {
    /// Relative standard deviation of natural frequencies.
    pub frequency: f64,
    /// Relative standard deviation of damping ratios.
    pub damping: f64,
    /// Relative standard deviation of modal stiffnesses.
    pub stiffness: f64,
    /// Relative standard deviation of the cutting coefficients K_tc, K_rc and K_ac.
    pub force: f64,
}

impl Default for Prior {
    /// The uncertainty of a model from data sheets and material tables: relative standard deviations of 1 % of
    /// frequencies, 20 % of damping ratios, 15 % of stiffnesses and of cutting coefficients.
    fn default() -> Self {
        Self {
            frequency: 0.01,
            damping: 0.2,
            stiffness: 0.15,
            force: 0.15,
        }
    }
}

/// All unknowns of a plan. A vector of unknowns holds first the variables that the stability limits depend on, then the
/// differences of the structure between standstill and cutting, then the gain of the hammer test and the gain of the
/// dynamometer.
#[derive(Clone, Debug)]
pub(super) struct Unknowns {
    /// Unknown parameters of the case on which the stability limits depend.
    pub(super) variables: Vec<Variable>,
    /// Differences of natural frequencies and damping ratios at standstill from those during cutting.
    pub(super) standstill: Vec<Variable>,
    /// Names of all unknowns, in the order of a vector of unknowns.
    pub(super) names: Vec<String>,
    /// True if the case states uncertainties; otherwise those of the prior are assumed.
    pub(super) stated: bool,
}

/// The case parameter of an entry (row, column) of a mass, damping or stiffness matrix.
type Entry = fn(usize, usize) -> Parameter;

/// Name of a mode or joint, and the changes of the case's parameters for a relative change of 1 (100 %) in its
/// frequency, in its damping ratio, and in its stiffness or compliance.
type ModeChanges = (String, [Vec<Deviation>; 3]);

/// An unknown variable of the plan with its name for the user.
struct Named {
    variable: Variable,
    name: String,
}

impl Unknowns {
    /// The unknowns of a plan. Those of the limits are the parameters whose standard deviations or covariance the case
    /// states (keys that end in `_std`, `[uncertainty]`), or else those of `prior`; `means` adds the others.
    ///
    /// # Errors
    /// No parameter of the case is unknown, or the modes of the matrices cannot be computed; the text gives the reason.
    pub(super) fn new(case: &Case, prior: &Prior, means: &Means) -> Result<Self, String> {
        let stated = case.is_uncertain();
        let named = if stated {
            of_case(case)
        } else {
            let mut named = of_modes(case, [prior.frequency, prior.damping, prior.stiffness], "")?;
            named.extend(of_forces(case, prior.force));
            named
        };
        if named.is_empty() {
            return Err("nothing is unknown; larger deviations are needed".into());
        }
        let standstill = of_modes(
            case,
            [means.standstill_frequency, means.standstill_damping, 0.0],
            " at standstill against cutting",
        )?;
        let gain = |of: &str| format!("gain of {of}, {} %", percent(means.calibration));
        let names = named.iter().chain(&standstill).map(|one| one.name.clone());
        let gains = [gain("hammer and accelerometer"), gain("the dynamometer")];
        Ok(Self {
            names: names.chain(gains).collect(),
            variables: named.into_iter().map(|one| one.variable).collect(),
            standstill: standstill.into_iter().map(|one| one.variable).collect(),
            stated,
        })
    }

    /// Number of unknowns, including the differences at standstill and the two gains.
    pub(super) fn len(&self) -> usize {
        self.names.len()
    }

    /// Index of the gain of hammer and accelerometer in a vector of unknowns.
    pub(super) fn hammer_gain(&self) -> usize {
        self.len() - 2
    }

    /// Index of the gain of the dynamometer in a vector of unknowns.
    pub(super) fn dynamometer_gain(&self) -> usize {
        self.len() - 1
    }
}

fn percent(share: f64) -> String {
    format!("{}", (1e4 * share).round() / 100.0)
}

fn of_case(case: &Case) -> Vec<Named> {
    let named = |variable: Variable| {
        let keys: Vec<String> = variable.parts().iter().map(|part| part.parameter.key()).collect();
        // Only a variable of a covariance has more than two parameters: the first, and later ones that correlate with
        // it.
        let name = match keys.as_slice() {
            [first, _, _, ..] => format!("{first} with {} correlated parameters", keys.len() - 1),
            few => few.join(" with "),
        };
        Named { variable, name }
    };
    Variable::of_case(case).into_iter().map(named).collect()
}

fn of_forces(case: &Case, relative: f64) -> Vec<Named> {
    [Parameter::Ktc, Parameter::Krc, Parameter::Kac]
        .into_iter()
        .filter_map(|parameter| {
            let std = relative * parameter.value(case)?.abs();
            (std > 0.0).then(|| Named {
                variable: Variable::together(vec![Deviation { parameter, std }]),
                name: format!("{}, {} %", parameter.key(), percent(relative)),
            })
        })
        .collect()
}

/// Unknowns for frequency, damping ratio and stiffness of each mode or robot joint, with the relative standard
/// deviations `relative` in this order; a deviation of 0 gives no unknown.
///
/// # Errors
/// The modes of the matrices cannot be computed.
fn of_modes(case: &Case, relative: [f64; 3], suffix: &str) -> Result<Vec<Named>, String> {
    let Some(structure) = &case.structure else {
        return Ok(Vec::new());
    };
    let modes: Vec<ModeChanges> = match &structure.form {
        Form::Modes(modes) => modes.iter().enumerate().map(of_mode).collect(),
        Form::Matrices(matrices) => of_matrices(matrices)?,
        Form::Joints(robot) => robot.joints.iter().enumerate().map(of_joint).collect(),
    };
    let words = ["frequency", "damping ratio", "modal stiffness"];
    let mut named = Vec::new();
    for (what, parts) in modes {
        for ((parts, relative), word) in parts.into_iter().zip(relative).zip(words) {
            let parts: Vec<Deviation> = parts
                .into_iter()
                .map(|part| Deviation {
                    std: relative * part.std,
                    ..part
                })
                .filter(|part| part.std != 0.0)
                .collect();
            if !parts.is_empty() {
                named.push(Named {
                    variable: Variable::together(parts),
                    name: format!("{word} of {what}{suffix}, {} %", percent(relative)),
                });
            }
        }
    }
    Ok(named)
}

/// Name of a mode, and the changes of its parameters in the case for a relative change of 1 (100 %) in frequency, in
/// damping ratio, and in compliance.
fn of_mode((index, mode): (usize, &Mode)) -> ModeChanges {
    let one = |parameter, std| vec![Deviation { parameter, std }];
    let shape = mode.left.iter().enumerate().flat_map(|(entry, value)| {
        [(value.re, false), (value.im, true)].map(|(std, imaginary)| Deviation {
            parameter: Parameter::Left(index, entry, imaginary),
            std,
        })
    });
    (
        the_mode(mode.frequency_hz),
        [
            one(Parameter::Frequency(index), mode.frequency_hz),
            one(Parameter::DampingRatio(index), mode.damping_ratio),
            shape.collect(),
        ],
    )
}

fn the_mode(frequency_hz: f64) -> String {
    format!("the mode at {frequency_hz:.2} Hz")
}

/// Name of a robot joint, and the changes of its parameters in the case for a relative change of 1 (100 %) in
/// frequency, damping ratio and stiffness of the joint with its link alone.
fn of_joint((index, joint): (usize, &Joint)) -> ModeChanges {
    let part = |parameter, std| Deviation { parameter, std };
    let stiffness = |factor: f64| {
        part(
            Parameter::JointStiffness(index),
            factor * joint.stiffness_nm_per_rad,
        )
    };
    let damping = part(Parameter::JointDamping(index), joint.damping_nms_per_rad);
    (
        format!("joint {}", index + 1),
        [
            // The frequency of the joint scales with √k at constant inertia: stiffness changes by twice the relative
            // change of frequency, damping c = 2ζ√(km) once.
            vec![stiffness(2.0), damping],
            vec![damping],
            vec![
                stiffness(1.0),
                damping,
                part(Parameter::LinkMass(index), joint.mass_kg),
            ],
        ],
    )
}

/// Names of the undamped modes Kφ = ω²Mφ of matrices, lowest frequency first, and the changes of the matrices for a
/// relative change of 1 (100 %) in frequency, damping ratio and stiffness of each mode. With φᵀMφ = 1 and φᵀCφ = 2ζω, a
/// change of one mode alone is a multiple of MφφᵀM.
///
/// Modes are those of the symmetric parts of the matrices; modes with ω² ≤ 0 are left out. Damping that couples modes
/// does not change.
///
/// # Errors
/// The mass matrix is not positive definite, or the eigenvalues cannot be computed.
fn of_matrices(matrices: &Matrices) -> Result<Vec<ModeChanges>, String> {
    let symmetric = |matrix: &DMatrix<f64>| (matrix + matrix.transpose()) * 0.5;
    let (mass, damping, stiffness) = (
        symmetric(&matrices.mass),
        symmetric(&matrices.damping),
        symmetric(&matrices.stiffness),
    );
    let eigen = of_symmetric_pencil(&stiffness, &mass).map_err(|error| match error {
        EigenvalueError::NotDefinite { .. } => {
            "the mass matrix is not positive definite, so that the structure has no modes".into()
        }
        error => format!("the modes of the structure cannot be computed: {error}"),
    })?;
    let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    let mode = |index: usize| {
        let squared = eigen.eigenvalues[index];
        if squared <= 0.0 {
            return None;
        }
        let shape: DVector<f64> = eigen.eigenvectors.column(index).into_owned();
        let driven = &mass * &shape;
        let unit = &driven * driven.transpose();
        let modal_damping = (shape.transpose() * &damping * &shape)[(0, 0)];
        let parts = |of_mass: f64, of_damping: f64, of_stiffness: f64| {
            let each: [(f64, Entry); 3] = [
                (of_mass, Parameter::Mass),
                (of_damping, Parameter::Damping),
                (of_stiffness, Parameter::Stiffness),
            ];
            let mut parts = Vec::new();
            for (factor, parameter) in each {
                for i in 0..unit.nrows() {
                    for j in 0..unit.ncols() {
                        parts.push(Deviation {
                            parameter: parameter(i, j),
                            std: factor * unit[(i, j)],
                        });
                    }
                }
            }
            parts
        };
        Some((
            the_mode(squared.sqrt() / TAU),
            [
                // A relative change of the frequency ω of the mode: ω² changes twice as much, and 2ζω once.
                parts(0.0, modal_damping, 2.0 * squared),
                parts(0.0, modal_damping, 0.0),
                parts(1.0, modal_damping, squared),
            ],
        ))
    };
    Ok(order.into_iter().filter_map(mode).collect())
}
