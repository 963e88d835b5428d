//! Search for all crossings of the unit circle by Floquet multipliers (characteristic multipliers) along the depth.

use num_complex::Complex64;

use super::multiplier_path::{Exponent, MultiplierPath, PathCrossing};
use crate::criteria::{CELL_FOLLOWED, LINE_FOLLOWED, LINE_LEVELS, LINE_POLISHED, PATH_TOLERANCE, SCANNED};
use crate::error::{NO_SOLUTION, StabilityError};
use crate::spectrum::along_depth::Spectrum;
use crate::spectrum::crossing::Crossing;
use crate::spectrum::root::Root;
use crate::spectrum::stability_loss::StabilityLoss;

/// Floquet multipliers larger than [`SCANNED`] at one axial depth.
#[derive(Clone, Debug)]
pub(super) struct Sample {
    depth_m: f64,
    /// Absolute value of the largest multiplier at this depth, not refined by Newton's method; 0 if none is found.
    largest: f64,
    /// Logarithms of the multipliers, each conjugate pair by its upper one.
    exponents: Vec<Exponent>,
    /// Multipliers outside the unit circle, each conjugate pair by its upper one.
    outer: Vec<Complex64>,
    /// True if every multiplier found at this depth whose absolute value is at least [`LINE_FOLLOWED`] has a derivative
    /// over the depth.
    is_smooth: bool,
}

impl Sample {
    /// Number of multipliers outside the unit circle at this depth, two for each conjugate pair.
    pub(super) fn outside(&self) -> i32 {
        let counts = self.outer.iter().map(|outer| StabilityLoss::of(*outer).count());
        counts.sum()
    }
}

/// Crossing of the unit circle with its direction over increasing depth.
#[derive(Clone, Copy, Debug)]
pub(super) struct DirectedCrossing {
    pub(super) crossing: Crossing,
    pub(super) outward: bool,
}

/// Scan over the depth at one spindle speed, from small to large depths.
pub(super) struct Scan<S> {
    pub(super) rpm: f64,
    pub(super) spectrum: S,
    /// Distance of the depths at which the largest multiplier is stated, m.
    pub(super) step_m: f64,
    /// Crossings found so far, by ascending depth.
    pub(super) crossings: Vec<DirectedCrossing>,
    /// Absolute value of the largest multiplier at multiples of `step_m` so far, from depth 0.
    pub(super) largest: Vec<f64>,
}

impl<S: Spectrum> Scan<S> {
    pub(super) fn broke_down(&self, depth_m: f64, what: &'static str) -> StabilityError {
        StabilityError::BrokeDown {
            rpm: self.rpm,
            depth_mm: depth_m * 1e3,
            what,
        }
    }

    /// Computes the multipliers larger than [`SCANNED`] at an axial depth.
    ///
    /// # Errors
    /// The equations have no finite solution, or the eigenvalues cannot be computed.
    pub(super) fn sample(&mut self, depth_m: f64) -> Result<Sample, StabilityError> {
        let all = self
            .spectrum
            .multipliers(depth_m)
            .map_err(|cause| cause.at(self.rpm, depth_m * 1e3, NO_SOLUTION))?;
        let mut sample = Sample {
            depth_m,
            largest: all.first().map_or(0.0, |multiplier| multiplier.norm()),
            exponents: Vec::with_capacity(4),
            outer: Vec::with_capacity(4),
            is_smooth: true,
        };
        for coarse in all
            .into_iter()
            .take_while(|multiplier| multiplier.norm() > SCANNED)
            .filter(|multiplier| multiplier.im >= 0.0)
        {
            let (multiplier, slope) = self.root(coarse, depth_m);
            if multiplier.norm() > 1.0 {
                sample.outer.push(multiplier);
            }
            sample.is_smooth &= slope.is_some() || multiplier.norm() < LINE_FOLLOWED;
            sample.exponents.push(Exponent::from(&Root {
                multiplier,
                slope: slope.unwrap_or_default(),
            }));
        }
        Ok(sample)
    }

    /// Floquet multiplier with its derivative dμ/dw, `None` if this cannot be computed. The multiplier is refined by
    /// [`Spectrum::root_near`], and next to the unit circle by [`Spectrum::multiplier_near`], so that it counts on the
    /// right side; a refinement that fails is left out.
    fn root(&mut self, coarse: Complex64, depth_m: f64) -> (Complex64, Option<Complex64>) {
        let spectrum = &mut self.spectrum;
        let root = spectrum.root_near(coarse, depth_m);
        let mut multiplier = root.map_or(coarse, |root| root.multiplier);
        if (multiplier.norm() - 1.0).abs() < LINE_POLISHED {
            let polished = spectrum.multiplier_near(multiplier, depth_m, LINE_POLISHED);
            multiplier = polished.unwrap_or(multiplier);
        }
        let slope = root.map(|root| root.slope);
        (
            multiplier,
            slope.or_else(|| spectrum.sensitivity(multiplier, depth_m)),
        )
    }

    /// Finds the crossings of the unit circle between two sampled depths, and states the largest multiplier there.
    /// `level` is the number of halvings that led to this depth interval.
    ///
    /// # Errors
    /// As [`sample`](Self::sample).
    pub(super) fn between(&mut self, low: &Sample, high: &Sample, level: u32) -> Result<(), StabilityError> {
        if let Some((paths, found)) = self.follow(low, high)
            && balance(&found) == high.outside() - low.outside()
        {
            self.crossings.extend(found);
            self.state_largest(low, high, &paths);
            return Ok(());
        }
        if level == LINE_LEVELS {
            let found = self.by_halving(low, high)?;
            self.crossings.extend(found);
            self.state_largest(low, high, &[]);
            return Ok(());
        }
        let middle = self.sample(0.5 * (low.depth_m + high.depth_m))?;
        self.between(low, &middle, level + 1)?;
        self.between(&middle, high, level + 1)
    }

    /// Follows each multiplier that may reach the unit circle between two sampled depths. Returns the paths of all
    /// multipliers with a partner at the other depth, and the crossings by ascending depth. `None` if a multiplier
    /// cannot be followed, may touch the circle, or crosses it at a depth that is not found; also if the interval is
    /// longer than the `step_m` of the scan and one of the samples is not smooth.
    fn follow(
        &mut self,
        low: &Sample,
        high: &Sample,
    ) -> Option<(Vec<MultiplierPath>, Vec<DirectedCrossing>)> {
        let step_m = high.depth_m - low.depth_m;
        if step_m > self.step_m && !(low.is_smooth && high.is_smooth) {
            return None;
        }
        let mut paths = paths(low, high)?;
        let depth_m = 0.5 * (low.depth_m + high.depth_m);
        let mut middles: Vec<Complex64> = Vec::with_capacity(paths.len());
        let mut found = Vec::new();
        for path in paths.iter_mut().filter(|path| path.may_reach()) {
            let middle = self.spectrum.corrected(path.multiplier_at(0.5), depth_m)?;
            let is_new = |other: &Complex64| (other - middle).norm() > 1e-6 * middle.norm();
            if path.correct(middle) > PATH_TOLERANCE || !middles.iter().all(is_new) {
                return None;
            }
            middles.push(middle);
            for crossing in path.crossings()? {
                found.push(self.cross(low, high, path, crossing)?);
            }
        }
        found.sort_by(|a, b| a.crossing.depth_m.total_cmp(&b.crossing.depth_m));
        Some((paths, found))
    }

    /// Crossing of the unit circle by a path, by Newton's method. `None` if the method fails, if it finds the crossing
    /// of another path or in the other direction, or if the multiplier has no derivative there.
    fn cross(
        &mut self,
        low: &Sample,
        high: &Sample,
        path: &MultiplierPath,
        expected: PathCrossing,
    ) -> Option<DirectedCrossing> {
        let step_m = high.depth_m - low.depth_m;
        let PathCrossing { share, outward } = expected;
        let guess = Crossing {
            depth_m: low.depth_m + share * step_m,
            multiplier: path.multiplier_at(share),
        };
        let crossing = self.spectrum.crossing_near(guess, low.depth_m, high.depth_m)?;
        // The crossing must lie on this path to within the error of the path's cubic and 1e-6.
        let on_path = path.multiplier_at((crossing.depth_m - low.depth_m) / step_m);
        let slope = self.spectrum.sensitivity(crossing.multiplier, crossing.depth_m)?;
        let is_outward = (crossing.multiplier.conj() * slope).re > 0.0;
        let is_same = (crossing.multiplier - on_path).norm() < path.error() + 1e-6;
        (is_same && is_outward == outward).then_some(DirectedCrossing { crossing, outward })
    }

    /// Bisects a depth interval on the number of multipliers outside the unit circle. Finds one crossing, or none if
    /// the number is the same at both ends.
    fn by_halving(&mut self, low: &Sample, high: &Sample) -> Result<Vec<DirectedCrossing>, StabilityError> {
        let (mut low, mut high) = (low.clone(), high.clone());
        if low.outside() == high.outside() {
            return Ok(Vec::new());
        }
        while high.depth_m - low.depth_m > 1e-10 * high.depth_m {
            let middle = self.sample(0.5 * (low.depth_m + high.depth_m))?;
            if middle.outside() == low.outside() {
                low = middle;
            } else {
                high = middle;
            }
        }
        let outward = high.outside() > low.outside();
        let outer = if outward { &high } else { &low };
        let crossed = outer
            .outer
            .iter()
            .min_by(|a, b| a.norm().total_cmp(&b.norm()))
            .ok_or_else(|| {
                self.broke_down(
                    high.depth_m,
                    "a Floquet multiplier was lost while the interval of depth was halved",
                )
            })?;
        Ok(vec![DirectedCrossing {
            crossing: Crossing {
                depth_m: 0.5 * (low.depth_m + high.depth_m),
                multiplier: crossed / crossed.norm(),
            },
            outward,
        }])
    }

    /// States the absolute value of the largest multiplier at the depths, multiples of `step_m`, from that of `low` to
    /// before that of `high`: that of the paths, or, if they may miss the largest, the larger of that and the exponential
    /// through both ends.
    fn state_largest(&mut self, low: &Sample, high: &Sample, paths: &[MultiplierPath]) {
        if self.step_m <= 0.0 {
            return;
        }
        // Each dominant multiplier at either depth must lie on a path.
        let are_followed = |sample: &Sample, share: f64| {
            let is_dominant = |size: &f64| *size >= CELL_FOLLOWED * sample.largest;
            let sizes = sample.exponents.iter().map(|exponent| exponent.value.re.exp());
            let on_paths = paths.iter().map(|path| path.at(share).re.exp());
            on_paths.filter(is_dominant).count() >= sizes.filter(is_dominant).count()
        };
        let are_complete = !paths.is_empty() && are_followed(low, 0.0) && are_followed(high, 1.0);
        loop {
            let depth_m = self.largest.len() as f64 * self.step_m;
            let share = ((depth_m - low.depth_m) / (high.depth_m - low.depth_m)).max(0.0);
            if share > 1.0 - 1e-9 {
                return;
            }
            let followed = paths.iter().map(|path| path.at(share).re.exp());
            let largest = followed.fold(0.0, f64::max);
            let through_ends = low.largest.powf(1.0 - share) * high.largest.powf(share);
            self.largest.push(if are_complete {
                largest
            } else {
                largest.max(through_ends)
            });
        }
    }

    /// States the largest multiplier at the last depth of the scan.
    pub(super) fn end(&mut self, last: &Sample) {
        self.largest.push(last.largest);
    }
}

/// Paths between two sampled depths of the multipliers that have a partner at the other depth; `None` if one without a
/// partner is followed and may reach the unit circle.
fn paths(low: &Sample, high: &Sample) -> Option<Vec<MultiplierPath>> {
    let step_m = high.depth_m - low.depth_m;
    let mut free = high.exponents.clone();
    let mut paths = Vec::with_capacity(free.len());
    let is_stray = |exponent: &Exponent| exponent.is_followed() && exponent.may_reach(step_m);
    for from in &low.exponents {
        match from.take_next(&mut free, step_m) {
            Some(to) => paths.push(MultiplierPath::new(*from, to, step_m)),
            None if is_stray(from) => return None,
            None => {}
        }
    }
    (!free.iter().any(is_stray)).then_some(paths)
}

/// Change of the number of multipliers outside the unit circle over the crossings `found`, from small to large depth.
fn balance(found: &[DirectedCrossing]) -> i32 {
    found
        .iter()
        .map(|found| {
            let count = StabilityLoss::of(found.crossing.multiplier).count();
            if found.outward { count } else { -count }
        })
        .sum()
}
