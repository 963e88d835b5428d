//! Causes that are restoring forces: their equations are those of the simulation, evaluated along the measured motion.

use crate::baseline::terms_of;
use crate::candidates::cause::{Cause, LocatedEffect, Location, Parameter, Regressor, Regressors};
use crate::records::record::Record;
use crate::records::study::Study;
use quietcut_model::effects::EffectName;
use quietcut_simulate::Effects;
use quietcut_simulate::path::restoring_along;

/// A cause that is a restoring force f_r = Σ coefficient · f(x, v, t; nonlinear parameters) of displacement x and
/// velocity v of the tool and of time t.
pub(super) struct Restoring {
    pub(super) effect: EffectName,
    /// Parameter keys of the coefficients in which the restoring force is linear.
    pub(super) linear: &'static [&'static str],
    /// Keys of the nonlinear parameters.
    pub(super) nonlinear_parameters: &'static [&'static str],
    /// Parameters of the restoring force along one axis that are not fitted, such as a scale.
    pub(super) fixed: fn(&Study<'_>, usize) -> Vec<Parameter>,
    /// Number of axes at each location of the restoring force: 2 for a potential that couples two axes, otherwise 1.
    pub(super) axes: usize,
    /// True if exchanging the two axes of a coupling leaves the restoring force unchanged: (a, b) and (b, a) are then
    /// one location.
    pub(super) is_symmetric: bool,
    /// True if the diagnosis also tries this restoring force along all axes with the same coefficients, if more than
    /// one axis is driven.
    pub(super) everywhere: bool,
    /// True if the diagnosis also tries this restoring force with separate coefficients along all driven axes together,
    /// as in joints of one kind. A driven axis is one along which some record has a force or a motion above the noise.
    /// A force that is tried like this has no nonlinear parameters.
    pub(super) each: bool,
    /// Sets of start values of the restoring force's nonlinear parameters for one axis, from the records of the study:
    /// for example from the displacement amplitudes along this axis.
    pub(super) nonlinear_grid: fn(&Study<'_>, usize) -> Vec<Vec<f64>>,
    /// Lowest and highest value of each nonlinear parameter for one axis.
    pub(super) bounds: fn(&Study<'_>, usize) -> Vec<[f64; 2]>,
    /// True if the restoring force acts behind a backlash; the answer then also names the backlash.
    pub(super) behind_backlash: bool,
    /// True if the coefficients of the restoring force along one axis are physically possible.
    pub(super) physical: fn(coefficients: &[f64]) -> bool,
}

/// Description of a restoring force along one axis that is linear in its coefficients; the coefficients may have either
/// sign.
pub(super) const fn plain(effect: EffectName, linear: &'static [&'static str]) -> Restoring {
    Restoring {
        effect,
        linear,
        nonlinear_parameters: &[],
        fixed: |_, _| Vec::new(),
        axes: 1,
        is_symmetric: false,
        everywhere: false,
        each: false,
        nonlinear_grid: |_, _| vec![Vec::new()],
        bounds: |_, _| Vec::new(),
        behind_backlash: false,
        physical: |_| true,
    }
}

/// The largest absolute displacement of the tool along an axis in any record, m.
pub(super) fn largest_m(study: &Study<'_>, axis: usize) -> f64 {
    study
        .records
        .iter()
        .map(|record| record.motion.largest_m(axis))
        .fold(0.0, f64::max)
}

/// The smallest RMS displacement of the tool along an axis over the records in which it is not zero, m; infinite if
/// there is no such record.
pub(super) fn smallest_m(study: &Study<'_>, axis: usize) -> f64 {
    study
        .records
        .iter()
        .map(|record| record.motion.size_m(axis))
        .filter(|size| *size > 0.0)
        .fold(f64::INFINITY, f64::min)
}

/// Duration of the longest record of the study, s.
pub(super) fn longest_s(study: &Study<'_>) -> f64 {
    study
        .records
        .iter()
        .map(|record| record.grid.count() as f64 / record.grid.rate_hz())
        .fold(0.0, f64::max)
}

fn first_axis(location: &Location) -> usize {
    match location {
        Location::Axis(axis) | Location::Axes(axis, _) => *axis,
        _ => 0,
    }
}

/// Splits the location of a restoring force into locations with coefficients of their own: one for each axis of
/// [`Location::EachOf`], otherwise the location itself.
fn single_locations(location: &Location) -> Vec<Location> {
    match location {
        Location::EachOf(axes) => axes.iter().map(|axis| Location::Axis(*axis)).collect(),
        one => vec![one.clone()],
    }
}

/// `count` values from `first` to `last`, equally spaced in their logarithm.
pub(super) fn logarithmic(first: f64, last: f64, count: usize) -> Vec<f64> {
    (0..count)
        .map(|index| first * (last / first).powf(index as f64 / (count - 1).max(1) as f64))
        .collect()
}

impl Restoring {
    /// True if the case already has an extension with a name of this cause, which is then no candidate: a case can hold
    /// only one extension of each name.
    fn in_baseline(&self, study: &Study<'_>) -> bool {
        self.names()
            .iter()
            .any(|name| study.baseline.case.extensions.contains_key(*name))
    }

    fn table(&self, location: &Location, nonlinear_parameters: &[f64], coefficients: &[f64]) -> toml::Table {
        let mut table = location.table();
        for (key, value) in self
            .linear
            .iter()
            .zip(coefficients)
            .chain(self.nonlinear_parameters.iter().zip(nonlinear_parameters))
        {
            table.insert((*key).into(), (*value).into());
        }
        table
    }

    /// Entries of the answer for a restoring force at one location: the force, and the backlash before it if there is
    /// one.
    fn effects_along_one_axis(&self, location: &Location, parameters: &[Parameter]) -> Vec<LocatedEffect> {
        let of_play = |(key, _): &&Parameter| self.behind_backlash && self.nonlinear_parameters.contains(key);
        let own: Vec<Parameter> = parameters.iter().filter(|p| !of_play(p)).copied().collect();
        let mut parts = vec![LocatedEffect {
            name: self.name(),
            location: location.clone(),
            extension: self.extension(location, &own),
            parameters: own,
        }];
        if self.behind_backlash {
            let of_gap = |(key, value): &Parameter| match *key {
                "play_mm" => ("gap_mm", *value),
                key => (key, *value),
            };
            let gap: Vec<Parameter> = parameters.iter().filter(of_play).map(of_gap).collect();
            let mut extension = toml::Table::new();
            extension.insert("before".into(), self.name().into());
            extension.extend(
                gap.iter()
                    .map(|(key, value)| ((*key).to_owned(), (*value).into())),
            );
            parts.push(LocatedEffect {
                name: EffectName::Backlash.name(),
                location: location.clone(),
                parameters: gap,
                extension,
            });
        }
        parts
    }

    /// Regressor of coefficient number `index`: the restoring force along the motion of a record if that coefficient is
    /// 1 and the others are 0, or the reason why the extension cannot be applied to the structure.
    fn along(
        &self,
        study: &Study<'_>,
        record: &Record,
        location: &Location,
        nonlinear_parameters: &[f64],
        index: usize,
    ) -> Result<Regressor, String> {
        let unit: Vec<f64> = (0..self.linear.len())
            .map(|i| f64::from(u8::from(i == index)))
            .collect();
        let mut table = self.table(location, nonlinear_parameters, &unit);
        for (key, value) in (self.fixed)(study, first_axis(location)) {
            table.insert(key.into(), value.into());
        }
        let effects = Effects::of_extension(self.name(), &table).map_err(|error| error.to_string())?;
        let terms = terms_of(&effects, study.baseline.structure).map_err(|error| error.to_string())?;
        let mut sum: [Vec<f64>; 3] = std::array::from_fn(|_| Vec::new());
        for term in terms {
            for (sum, force) in sum.iter_mut().zip(restoring_along(&*term, &record.motion)) {
                if sum.is_empty() {
                    *sum = force;
                } else {
                    sum.iter_mut().zip(force).for_each(|(sum, force)| *sum += force);
                }
            }
        }
        Ok(Regressor::of_force(sum))
    }
}

impl Cause for Restoring {
    fn effect(&self) -> EffectName {
        self.effect
    }

    fn names(&self) -> Vec<&'static str> {
        if self.behind_backlash {
            vec![self.name(), EffectName::Backlash.name()]
        } else {
            vec![self.name()]
        }
    }

    fn located_effects(&self, location: &Location, parameters: &[Parameter]) -> Vec<LocatedEffect> {
        let locations = single_locations(location);
        let of_one = (parameters.len() / locations.len()).max(1);
        locations
            .iter()
            .zip(parameters.chunks(of_one))
            .flat_map(|(location, parameters)| self.effects_along_one_axis(location, parameters))
            .collect()
    }

    fn locations(&self, study: &Study<'_>) -> Vec<Location> {
        if self.in_baseline(study) {
            return Vec::new();
        }
        let axes = study.driven_axes();
        match self.axes {
            1 => {
                let several = axes.len() > 1;
                let together = (several && self.everywhere).then_some(Location::Everywhere);
                let each = (several && self.each).then(|| Location::EachOf(axes.clone()));
                let single = axes.into_iter().map(Location::Axis);
                single.chain(together).chain(each).collect()
            }
            _ => axes
                .iter()
                .flat_map(|a| axes.iter().map(move |b| (*a, *b)))
                .filter(|(a, b)| a != b)
                // A symmetric potential has one location for each pair of axes, not two.
                .filter(|(a, b)| !self.is_symmetric || a < b)
                .map(|(a, b)| Location::Axes(a, b))
                .collect(),
        }
    }

    fn nonlinear_grid(&self, study: &Study<'_>, location: &Location) -> Vec<Vec<f64>> {
        (self.nonlinear_grid)(study, first_axis(location))
    }

    fn bounds(&self, study: &Study<'_>, location: &Location) -> Vec<[f64; 2]> {
        (self.bounds)(study, first_axis(location))
    }

    fn regressors(
        &self,
        study: &Study<'_>,
        record: &Record,
        location: &Location,
        nonlinear_parameters: &[f64],
    ) -> Regressors {
        single_locations(location)
            .iter()
            .flat_map(|location| (0..self.linear.len()).map(move |index| (location, index)))
            .map(|(location, index)| self.along(study, record, location, nonlinear_parameters, index))
            .collect()
    }

    fn parameters(
        &self,
        study: &Study<'_>,
        location: &Location,
        nonlinear_parameters: &[f64],
        coefficients: &[f64],
    ) -> Option<Vec<Parameter>> {
        let fixed = (self.fixed)(study, first_axis(location));
        let mut laws = coefficients.chunks(self.linear.len());
        laws.clone().all(self.physical).then(|| {
            laws.by_ref()
                .flat_map(|law| {
                    self.linear
                        .iter()
                        .zip(law)
                        .chain(self.nonlinear_parameters.iter().zip(nonlinear_parameters))
                        .map(|(key, value)| (*key, *value))
                        .chain(fixed.iter().copied())
                })
                .collect()
        })
    }
}
