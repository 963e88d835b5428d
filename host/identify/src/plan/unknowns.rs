//! The unknowns: independent normal variables, each in units of its standard deviation.

use std::f64::consts::TAU;

use nalgebra::{Cholesky, DMatrix, DVector};
use quietcut_numerics::eigenvalues::of_symmetric;

use super::means::Means;
use quietcut_model::case::{Case, Deviation, Parameter};
use quietcut_model::structure::{Form, Joint, Matrices, Mode};
use quietcut_stability::Variable;

/// Standard deviations, relative, of a case that states none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior {
    /// Of natural frequencies.
    pub frequency: f64,
    /// Of damping ratios.
    pub damping: f64,
    /// Of modal stiffnesses.
    pub stiffness: f64,
    /// Of K_tc, K_rc and K_ac.
    pub force: f64,
}

impl Default for Prior {
    /// The uncertainty of a model from data sheets and material tables: 1 % of frequency, 20 % of damping, 15 % of stiffness and of
    /// cutting force.
    fn default() -> Self {
        Self {
            frequency: 0.01,
            damping: 0.2,
            stiffness: 0.15,
            force: 0.15,
        }
    }
}

/// All that is not known. In vectors over it come first the variables that limits depend on, then what only tests at
/// standstill see, then the gains of hammer with accelerometer and of the dynamometer.
#[derive(Clone, Debug)]
pub(super) struct Unknowns {
    /// Variables that limits depend on.
    pub(super) variables: Vec<Variable>,
    /// How the structure differs at standstill.
    pub(super) standstill: Vec<Variable>,
    /// Names, standstill and gains included.
    pub(super) names: Vec<String>,
    /// True where the case states its deviations.
    pub(super) stated: bool,
}

/// A matrix, as the parameter that an entry of it is.
type Entry = fn(usize, usize) -> Parameter;

/// A variable and what it is.
struct Named {
    variable: Variable,
    name: String,
}

impl Unknowns {
    /// Those that the case states (keys that end in `_std`), or else those of `prior`; `None` where there is none.
    pub(super) fn new(case: &Case, prior: &Prior, means: &Means) -> Option<Self> {
        let stated = !case.deviations.is_empty();
        let named = if stated {
            of_case(case)
        } else {
            let mut named = of_modes(case, [prior.frequency, prior.damping, prior.stiffness], "");
            named.extend(of_forces(case, prior.force));
            named
        };
        if named.is_empty() {
            return None;
        }
        let standstill = of_modes(
            case,
            [means.standstill_frequency, means.standstill_damping, 0.0],
            " at standstill against cutting",
        );
        let gain = |of: &str| format!("gain of {of}, {} %", percent(means.calibration));
        let names = named.iter().chain(&standstill).map(|one| one.name.clone());
        let gains = [gain("hammer and accelerometer"), gain("the dynamometer")];
        Some(Self {
            names: names.chain(gains).collect(),
            variables: named.into_iter().map(|one| one.variable).collect(),
            standstill: standstill.into_iter().map(|one| one.variable).collect(),
            stated,
        })
    }

    /// Number of unknowns, standstill and gains included.
    pub(super) fn len(&self) -> usize {
        self.names.len()
    }

    /// Where the gain of hammer and accelerometer stands.
    pub(super) fn hammer_gain(&self) -> usize {
        self.len() - 2
    }

    /// Where the gain of the dynamometer stands.
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
        Named {
            variable,
            name: keys.join(" with "),
        }
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

/// Frequency, damping ratio and stiffness of each mode, with these relative deviations; those of 0 are none.
fn of_modes(case: &Case, relative: [f64; 3], suffix: &str) -> Vec<Named> {
    let Some(structure) = &case.structure else {
        return Vec::new();
    };
    let modes: Vec<(String, [Vec<Deviation>; 3])> = match &structure.form {
        Form::Modes(modes) => modes.iter().enumerate().map(of_mode).collect(),
        Form::Matrices(matrices) => of_matrices(matrices),
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
    named
}

/// Frequency, and what changes with a relative change of frequency, damping ratio and compliance.
fn of_mode((index, mode): (usize, &Mode)) -> (String, [Vec<Deviation>; 3]) {
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

/// The same of a joint with its link, were it alone.
fn of_joint((index, joint): (usize, &Joint)) -> (String, [Vec<Deviation>; 3]) {
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
            // k ~ ω² and c ~ ω.
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

/// The same of matrices, by their undamped modes Kφ = ω²Mφ, φᵀMφ = 1, with the damping φᵀCφ = 2ζω: what belongs to a mode
/// alone are multiples of Mφφᵀ M.
///
/// Only the symmetric parts have such modes; couplings by damping stay as they are.
fn of_matrices(matrices: &Matrices) -> Vec<(String, [Vec<Deviation>; 3])> {
    let symmetric = |matrix: &DMatrix<f64>| (matrix + matrix.transpose()) * 0.5;
    let (mass, damping, stiffness) = (
        symmetric(&matrices.mass),
        symmetric(&matrices.damping),
        symmetric(&matrices.stiffness),
    );
    let Some(root) = Cholesky::new(mass.clone()).map(|cholesky| cholesky.l()) else {
        return Vec::new();
    };
    let Some(inverse) = root.clone().try_inverse() else {
        return Vec::new();
    };
    let Ok(eigen) = of_symmetric(&inverse * &stiffness * inverse.transpose()) else {
        return Vec::new();
    };
    let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    let mode = |index: usize| {
        let squared = eigen.eigenvalues[index];
        if squared <= 0.0 {
            return None;
        }
        let shape: DVector<f64> = inverse.transpose() * eigen.eigenvectors.column(index);
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
                // ω and with it 2ζω.
                parts(0.0, modal_damping, 2.0 * squared),
                parts(0.0, modal_damping, 0.0),
                parts(1.0, modal_damping, squared),
            ],
        ))
    };
    order.into_iter().filter_map(mode).collect()
}
