//! Terms of the restoring side: their equations are those of the simulation, taken along the measured motion.

mod backlash;
mod coulomb_friction;
mod cubic_damping;
mod cubic_stiffness;
mod drift;
mod hysteresis;
mod mode_coupling;
mod quadratic_stiffness;
mod softening_hardening;

use crate::baseline::terms_of;
use crate::candidates::cause::{Cause, Parameter, Part, Place, Regressor};
use crate::records::record::Record;
use crate::records::study::Scene;
use quietcut_simulate::Effects;
use quietcut_simulate::path::restoring_along;

pub(crate) fn all() -> Vec<Box<dyn Cause>> {
    [
        cubic_stiffness::CAUSE,
        quadratic_stiffness::CAUSE,
        cubic_damping::CAUSE,
        softening_hardening::CAUSE,
        coulomb_friction::ALIKE,
        coulomb_friction::EACH_WAY,
        coulomb_friction::BEHIND_PLAY,
        coulomb_friction::BEHIND_CLEARANCE,
        backlash::CAUSE,
        hysteresis::CAUSE,
        mode_coupling::QUARTIC,
        mode_coupling::CUBIC,
        drift::RATE,
        drift::SETTLING,
    ]
    .into_iter()
    .map(|cause| Box::new(cause) as Box<dyn Cause>)
    .collect()
}

/// A term f_r = Σ coefficient · f(x, v, t; shape).
struct Restoring {
    name: &'static str,
    /// Keys of the coefficients.
    linear: &'static [&'static str],
    /// Keys of the shape.
    shape: &'static [&'static str],
    /// How many axes it joins.
    axes: usize,
    /// Whether it may also act along all axes at once, by one law.
    everywhere: bool,
    /// Whether it may also act along each of them by a law of its own, as in joints of one kind; it has no shape then.
    each: bool,
    /// A grid of shapes for what moves as it does in the scene.
    shapes: fn(&Scene<'_>, usize) -> Vec<Vec<f64>>,
    /// Bounds of the shape.
    bounds: fn(&Scene<'_>, usize) -> Vec<[f64; 2]>,
    /// Whether it acts behind a play, which is a backlash.
    behind_play: bool,
    /// Whether coefficients and shape are physical.
    physical: fn(coefficients: &[f64]) -> bool,
}

/// A linear one that may have either sign.
const fn plain(name: &'static str, linear: &'static [&'static str]) -> Restoring {
    Restoring {
        name,
        linear,
        shape: &[],
        axes: 1,
        everywhere: false,
        each: false,
        shapes: |_, _| vec![Vec::new()],
        bounds: |_, _| Vec::new(),
        behind_play: false,
        physical: |_| true,
    }
}

/// The largest displacement along an axis in any record, m.
fn largest_m(scene: &Scene<'_>, axis: usize) -> f64 {
    scene
        .records
        .iter()
        .map(|record| record.motion.largest_m(axis))
        .fold(0.0, f64::max)
}

/// The smallest RMS displacement along an axis of any record, m.
fn smallest_m(scene: &Scene<'_>, axis: usize) -> f64 {
    scene
        .records
        .iter()
        .map(|record| record.motion.size_m(axis))
        .filter(|size| *size > 0.0)
        .fold(f64::INFINITY, f64::min)
}

/// The longest record, s.
fn longest_s(scene: &Scene<'_>) -> f64 {
    scene
        .records
        .iter()
        .map(|record| record.grid.count() as f64 / record.grid.rate_hz())
        .fold(0.0, f64::max)
}

fn first_axis(place: &Place) -> usize {
    match place {
        Place::Axis(axis) | Place::Axes(axis, _) => *axis,
        _ => 0,
    }
}

/// The places where a law is to be said: one, unless it is another along each axis.
fn single_places(place: &Place) -> Vec<Place> {
    match place {
        Place::EachOf(axes) => axes.iter().map(|axis| Place::Axis(*axis)).collect(),
        one => vec![one.clone()],
    }
}

/// `count` values from `first` to `last`, evenly in their logarithm.
fn logarithmic(first: f64, last: f64, count: usize) -> Vec<f64> {
    (0..count)
        .map(|index| first * (last / first).powf(index as f64 / (count - 1).max(1) as f64))
        .collect()
}

impl Restoring {
    /// True where the baseline has an extension of its name: a case holds one.
    fn in_baseline(&self, scene: &Scene<'_>) -> bool {
        self.names()
            .iter()
            .any(|name| scene.baseline.case.extensions.contains_key(*name))
    }

    fn table(&self, place: &Place, shape: &[f64], coefficients: &[f64]) -> toml::Table {
        let mut table = place.table();
        for (key, value) in self
            .linear
            .iter()
            .zip(coefficients)
            .chain(self.shape.iter().zip(shape))
        {
            table.insert((*key).into(), (*value).into());
        }
        table
    }

    /// What the answer says of the law along one axis.
    fn parts_of_one(&self, place: &Place, parameters: &[Parameter]) -> Vec<Part> {
        let of_play = |(key, _): &&Parameter| self.behind_play && self.shape.contains(key);
        let own: Vec<Parameter> = parameters.iter().filter(|p| !of_play(p)).copied().collect();
        let mut parts = vec![Part {
            name: self.name,
            place: place.clone(),
            extension: self.extension(place, &own),
            parameters: own,
        }];
        if self.behind_play {
            let of_gap = |(key, value): &Parameter| match *key {
                "play_mm" => ("gap_mm", *value),
                key => (key, *value),
            };
            let gap: Vec<Parameter> = parameters.iter().filter(of_play).map(of_gap).collect();
            let mut extension = toml::Table::new();
            extension.insert("before".into(), self.name.into());
            extension.extend(
                gap.iter()
                    .map(|(key, value)| ((*key).to_owned(), (*value).into())),
            );
            parts.push(Part {
                name: "backlash",
                place: place.clone(),
                parameters: gap,
                extension,
            });
        }
        parts
    }

    /// What one of its coefficients, 1, adds along the motion of a record; `None` where it cannot act there.
    fn along(
        &self,
        scene: &Scene<'_>,
        record: &Record,
        place: &Place,
        shape: &[f64],
        index: usize,
    ) -> Option<Regressor> {
        let unit: Vec<f64> = (0..self.linear.len())
            .map(|i| f64::from(u8::from(i == index)))
            .collect();
        let effects = Effects::of_extension(self.name, &self.table(place, shape, &unit)).ok()?;
        let mut sum: [Vec<f64>; 3] = std::array::from_fn(|_| Vec::new());
        for term in terms_of(&effects, scene.baseline.structure).ok()? {
            for (sum, force) in sum.iter_mut().zip(restoring_along(&*term, &record.motion)) {
                if sum.is_empty() {
                    *sum = force;
                } else {
                    sum.iter_mut().zip(force).for_each(|(sum, force)| *sum += force);
                }
            }
        }
        Some(Regressor::of_force(sum))
    }
}

impl Cause for Restoring {
    fn name(&self) -> &'static str {
        self.name
    }

    fn names(&self) -> Vec<&'static str> {
        if self.behind_play {
            vec![self.name, "backlash"]
        } else {
            vec![self.name]
        }
    }

    fn parts(&self, place: &Place, parameters: &[Parameter]) -> Vec<Part> {
        let places = single_places(place);
        let of_one = (parameters.len() / places.len()).max(1);
        places
            .iter()
            .zip(parameters.chunks(of_one))
            .flat_map(|(place, parameters)| self.parts_of_one(place, parameters))
            .collect()
    }

    fn places(&self, scene: &Scene<'_>) -> Vec<Place> {
        if self.in_baseline(scene) {
            return Vec::new();
        }
        let axes = scene.driven_axes();
        match self.axes {
            1 => {
                let several = axes.len() > 1;
                let together = (several && self.everywhere).then_some(Place::Everywhere);
                let each = (several && self.each).then(|| Place::EachOf(axes.clone()));
                let single = axes.into_iter().map(Place::Axis);
                single.chain(together).chain(each).collect()
            }
            _ => axes
                .iter()
                .flat_map(|a| axes.iter().map(move |b| (*a, *b)))
                .filter(|(a, b)| a != b)
                // A potential in which both enter alike is one place, not two.
                .filter(|(a, b)| self.name != "mode-coupling" || self.linear[0] != "kxyy_n_per_m3" || a < b)
                .map(|(a, b)| Place::Axes(a, b))
                .collect(),
        }
    }

    fn shapes(&self, scene: &Scene<'_>, place: &Place) -> Vec<Vec<f64>> {
        (self.shapes)(scene, first_axis(place))
    }

    fn bounds(&self, scene: &Scene<'_>, place: &Place) -> Vec<[f64; 2]> {
        (self.bounds)(scene, first_axis(place))
    }

    fn regressors(
        &self,
        scene: &Scene<'_>,
        record: &Record,
        place: &Place,
        shape: &[f64],
    ) -> Option<Vec<Regressor>> {
        single_places(place)
            .iter()
            .flat_map(|place| (0..self.linear.len()).map(move |index| (place, index)))
            .map(|(place, index)| self.along(scene, record, place, shape, index))
            .collect()
    }

    fn parameters(
        &self,
        _: &Scene<'_>,
        _: &Place,
        shape: &[f64],
        coefficients: &[f64],
    ) -> Option<Vec<Parameter>> {
        let mut laws = coefficients.chunks(self.linear.len());
        laws.clone().all(self.physical).then(|| {
            laws.by_ref()
                .flat_map(|law| self.linear.iter().zip(law).chain(self.shape.iter().zip(shape)))
                .map(|(key, value)| (*key, *value))
                .collect()
        })
    }
}
