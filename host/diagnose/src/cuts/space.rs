//! Variables of a fit to cuts: what is uncertain of the baseline, the sensors and the cuts, and the coordinates of
//! further effects.
//!
//! Every variable is standard normal before the records are seen. Zero is the baseline.

use nalgebra::DVector;

use super::candidate::Candidate;
use super::conditions::{Conditions, cut_model};
use super::machine::Machine;
use super::reading::Reading;
use super::record::ReducedCut;
use crate::baseline::{Baseline, pickup_of};
use crate::error::DiagnoseError;
use quietcut_model::case::{Case, Deviation, Parameter};
use quietcut_model::effects::EffectName;
use quietcut_model::{Effects, ModelError};
use quietcut_stability::Variable as CaseVariable;

/// Standard deviation of a parameter of a case that states none, relative to its value: the case is taken as exact to
/// the last digit that a case file usually has.
pub(crate) const ASSUMED_PARAMETER: f64 = 1e-3;
/// Standard deviation of the axial depth and the feed of a cut, relative.
pub(crate) const ASSUMED_CUT: f64 = 1e-3;
/// Standard deviation of the gain of a sensor.
pub(crate) const ASSUMED_GAIN: f64 = 1e-3;

/// Standard deviation of the delay of a channel against the others, in samples: 0.7° at a tenth of the sample rate.
pub(crate) const ASSUMED_DELAY: f64 = 0.02;

/// One variable.
#[derive(Clone, Debug)]
pub(crate) enum Variable {
    /// Parameters of the case that vary together.
    Baseline(CaseVariable),
    /// Gain of a channel, in all records.
    Gain(String),
    /// Delay of a channel, in all records.
    Delay(String),
    /// Phase of the tachometer of a record.
    Phase(usize),
    /// Axial depth of a record.
    Depth(usize),
    /// Feed of a record.
    Feed(usize),
    /// A coordinate of a candidate.
    Coordinate(usize, usize),
}

/// Variables with the baseline and the candidates to which they belong.
pub(crate) struct Space<'a> {
    pub baseline: &'a Baseline<'a>,
    pub candidates: Vec<Candidate>,
    pub variables: Vec<Variable>,
}

impl<'a> Space<'a> {
    /// What is uncertain without any candidate.
    pub(crate) fn new(baseline: &'a Baseline<'a>, records: &[ReducedCut]) -> Self {
        let mut variables: Vec<Variable> = uncertain(baseline.case)
            .into_iter()
            .map(Variable::Baseline)
            .collect();
        let mut channels: Vec<&String> = records
            .iter()
            .flat_map(|record| &record.orders.channels)
            .collect();
        channels.sort();
        channels.dedup();
        variables.extend(
            channels
                .into_iter()
                .flat_map(|name| [Variable::Gain(name.clone()), Variable::Delay(name.clone())]),
        );
        for index in 0..records.len() {
            variables.extend([
                Variable::Phase(index),
                Variable::Depth(index),
                Variable::Feed(index),
            ]);
        }
        Self {
            baseline,
            candidates: Vec::new(),
            variables,
        }
    }

    /// This space with a further candidate.
    pub(crate) fn with(&self, candidate: &Candidate) -> Self {
        let mut candidates = self.candidates.clone();
        let mut variables = self.variables.clone();
        let number = candidates.len();
        variables.extend((0..candidate.coordinates.len()).map(|index| Variable::Coordinate(number, index)));
        candidates.push(candidate.clone());
        Self {
            baseline: self.baseline,
            candidates,
            variables,
        }
    }

    /// This space and a point of it without the candidate `number`.
    pub(crate) fn without(&self, number: usize, z: &[f64]) -> (Self, Vec<f64>) {
        let is_coordinate = |variable: &Variable| matches!(variable, Variable::Coordinate(..));
        let known = self.variables.iter().filter(|variable| !is_coordinate(variable));
        let mut space = Self {
            baseline: self.baseline,
            candidates: Vec::new(),
            variables: known.cloned().collect(),
        };
        let mut point = z[..space.variables.len()].to_vec();
        for (other, candidate) in self.candidates.iter().enumerate() {
            if other != number {
                space = space.with(candidate);
                point.extend(self.coordinates(other, z));
            }
        }
        (space, point)
    }

    /// Number of variables that are no coordinates of candidates. They come first.
    pub(crate) fn known(&self) -> usize {
        let is_coordinate = |variable: &Variable| matches!(variable, Variable::Coordinate(..));
        self.variables
            .iter()
            .position(is_coordinate)
            .unwrap_or(self.variables.len())
    }

    /// Numbers of the variables that are coordinates of the candidate `number`.
    pub(crate) fn places_of(&self, number: usize) -> Vec<usize> {
        let is_own =
            |variable: &Variable| matches!(variable, Variable::Coordinate(other, _) if *other == number);
        (0..self.variables.len())
            .filter(|index| is_own(&self.variables[*index]))
            .collect()
    }

    /// Coordinates of the candidate `number` in `z`.
    pub(crate) fn coordinates(&self, number: usize, z: &[f64]) -> Vec<f64> {
        self.places_of(number).into_iter().map(|place| z[place]).collect()
    }

    /// Lowest value of a variable.
    pub(crate) fn lower(&self, variable: usize) -> f64 {
        match &self.variables[variable] {
            Variable::Coordinate(candidate, index) => self.candidates[*candidate].coordinates[*index].lower,
            _ => f64::NEG_INFINITY,
        }
    }

    /// True if a variable may act on a record.
    pub(crate) fn acts_on(&self, variable: usize, record: usize) -> bool {
        match self.variables[variable] {
            Variable::Phase(own) | Variable::Depth(own) | Variable::Feed(own) => own == record,
            _ => true,
        }
    }

    /// True if a variable changes only what sensors read.
    pub(crate) fn is_of_reading(&self, variable: usize) -> bool {
        match &self.variables[variable] {
            Variable::Gain(_) | Variable::Delay(_) => true,
            Variable::Coordinate(candidate, _) => {
                self.candidates[*candidate].effect.spec().class == quietcut_model::effects::Class::Sensor
            }
            _ => false,
        }
    }

    /// This space with the parameters of the case as it states them.
    pub(crate) fn as_written(&self) -> Self {
        let is_baseline = |variable: &&Variable| matches!(variable, Variable::Baseline(_));
        Self {
            baseline: self.baseline,
            candidates: self.candidates.clone(),
            variables: self
                .variables
                .iter()
                .filter(|variable| !is_baseline(variable))
                .cloned()
                .collect(),
        }
    }

    /// Variables of the case with their numbers.
    pub(crate) fn of_case(&self) -> impl Iterator<Item = (usize, &CaseVariable)> {
        self.variables
            .iter()
            .enumerate()
            .filter_map(|(number, variable)| match variable {
                Variable::Baseline(variable) => Some((number, variable)),
                _ => None,
            })
    }

    /// The case at a point of the space.
    pub(super) fn case(&self, z: &[f64]) -> Option<Case> {
        let (variables, at): (Vec<CaseVariable>, Vec<f64>) = self
            .of_case()
            .map(|(number, variable)| (variable.clone(), z[number]))
            .filter(|(_, z)| *z != 0.0)
            .unzip();
        let mut case = self.baseline.case.clone();
        CaseVariable::shift_all(&variables, &DVector::from_vec(at), &mut case).then_some(case)
    }

    /// Effects of the candidates at a point of the space.
    pub(crate) fn effects(&self, z: &[f64]) -> Result<Effects, DiagnoseError> {
        let mut effects = Effects::default();
        for (number, candidate) in self.candidates.iter().enumerate() {
            if let Some(table) = candidate.table(&self.coordinates(number, z)) {
                let further = Effects::of_extension(candidate.effect.name(), &table).map_err(|error| {
                    DiagnoseError::simulate(&self.baseline.case.path, ModelError::from(error))
                })?;
                effects = effects.and(&further);
            }
        }
        Ok(effects)
    }

    /// True if the machine changes along a record.
    pub(crate) fn depends_on_time(&self) -> bool {
        [EffectName::Wear, EffectName::Drift].into_iter().any(|effect| {
            self.baseline.case.has(effect)
                || self.candidates.iter().any(|candidate| candidate.effect == effect)
        })
    }

    /// The machine at a point of the space in the cut `number`, at a time from the start of its record; `None` if it is
    /// not possible. `near` reads the same record.
    pub(crate) fn machine(
        &self,
        z: &[f64],
        number: usize,
        record: &ReducedCut,
        time_s: f64,
        near: Option<&Reading>,
    ) -> Option<Machine> {
        let case = self.case(z)?;
        let effects = self.baseline.effects.clone().and(&self.effects(z).ok()?);
        let mut conditions = Conditions {
            time_s,
            ..record.conditions
        };
        if let Some(cut) = case.cut {
            conditions.cut.feed_direction_deg = cut.feed_direction_deg;
        }
        for (variable, z) in self.variables.iter().zip(z) {
            match variable {
                Variable::Depth(own) if *own == number => conditions.depth_m *= 1.0 + ASSUMED_CUT * z,
                Variable::Feed(own) if *own == number => {
                    conditions.cut.feed_per_tooth_mm *= 1.0 + ASSUMED_CUT * z
                }
                _ => {}
            }
        }
        let model = cut_model(&case, &effects, &conditions).ok()?;
        let pickups = record
            .orders
            .channels
            .iter()
            .map(|name| {
                let mut pickup = effects.pickup(pickup_of(name)?);
                for (variable, z) in self.variables.iter().zip(z) {
                    match variable {
                        Variable::Gain(channel) if channel == name => {
                            pickup.weights = pickup.weights.map(|weight| weight * (1.0 + ASSUMED_GAIN * z));
                        }
                        Variable::Delay(channel) if channel == name => {
                            pickup.delay_s += ASSUMED_DELAY * z / record.rate_hz;
                        }
                        _ => {}
                    }
                }
                Some(pickup)
            })
            .collect::<Option<Vec<_>>>()?;
        let (structure, rate_hz) = (&model.structure, record.rate_hz);
        let reading = match near {
            Some(near) => near.with(structure, pickups, rate_hz)?,
            None => Reading::new(structure, pickups, conditions.spindle_hz, record.highest, rate_hz)?,
        };
        Some(Machine { model, reading })
    }
}

/// Independent variables of a case: those that it states, otherwise each parameter of the structure and the material by
/// [`ASSUMED_PARAMETER`].
fn uncertain(case: &Case) -> Vec<CaseVariable> {
    if case.is_uncertain() {
        return CaseVariable::of_case(case);
    }
    let is_assumed = |parameter: &Parameter| {
        !matches!(
            parameter,
            Parameter::Start
                | Parameter::Exit
                | Parameter::FeedPerTooth
                | Parameter::FeedDirection
                | Parameter::EdgeAngle
                | Parameter::RunoutAngle
        )
    };
    Parameter::of_case(case)
        .into_iter()
        .filter(is_assumed)
        .filter_map(|parameter| {
            let value = parameter.value(case)?;
            (value != 0.0).then(|| {
                CaseVariable::together(vec![Deviation {
                    parameter,
                    std: ASSUMED_PARAMETER * value.abs(),
                }])
            })
        })
        .collect()
}
