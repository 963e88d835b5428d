//! The Nyquist criterion: unstable roots counted by the turns of a determinant, limits by the characteristic loci.

use super::multi_frequency::MultiFrequency;
use crate::error::StabilityError;
use crate::frequency::averaged::AveragedLoop;
use crate::frequency::harmonic::HarmonicLoop;
use crate::frequency::limits::{
    AxisCrossing, hertz, limits, outside_at_no_depth, speed_line, unstable_roots,
};
use crate::frequency::open_loop::OpenLoop;
use crate::frequency::problem::FrequencyProblem;
use crate::frequency::root;
use crate::limits::bounds::{check_depth, check_speed};
use crate::limits::method::Method;
use crate::limits::point::CutStability;
use crate::limits::speed_line::SpeedLine;

/// The generalized Nyquist criterion (MacFarlane & Postlethwaite) on modelled or measured receptances.
///
/// With averaged coefficients (K = 0) the line s = iω from 0 to infinity says all, and the criterion is exact for the
/// averaged cut. With K > 0 the coefficients are periodic: s from 0 to iΩ/2, and the determinant is that of the
/// harmonic transfer matrix with harmonics up to K (Wereley & Hall), exact but for what is truncated. Every depth between
/// two limits is confirmed by a count of the unstable roots, which does not use the loci.
#[derive(Clone, Debug)]
pub struct Nyquist {
    /// Receptances and cutting process.
    pub problem: FrequencyProblem,
    /// K, the highest harmonic of the coefficients; 0 for their average.
    pub harmonics: usize,
}

impl Nyquist {
    /// How many roots are unstable at a speed, rev/min, and a depth, mm: 2 for each complex pair.
    ///
    /// # Errors
    /// Speed not positive, depth negative, a depth that is a limit, or receptances that are infinite.
    pub fn unstable_roots(&self, rpm: f64, depth_mm: f64) -> Result<i32, StabilityError> {
        check_speed(rpm)?;
        check_depth(depth_mm)?;
        AveragedLoop::check_reach(&self.problem, depth_mm)?;
        let depth_m = depth_mm * 1e-3;
        let count = if self.harmonics == 0 {
            unstable_roots(&self.averaged(rpm), depth_m, 0.0)
        } else {
            unstable_roots(&self.periodic(rpm), depth_m, 0.0)
        };
        count.ok_or(StabilityError::BrokeDown {
            rpm,
            depth_mm,
            what: "the turns of the determinant cannot be counted",
        })
    }

    fn averaged(&self, rpm: f64) -> AveragedLoop<'_> {
        AveragedLoop::new(&self.problem, Some(rpm))
    }

    fn periodic(&self, rpm: f64) -> HarmonicLoop<'_> {
        HarmonicLoop::new(&self.problem, rpm, self.harmonics)
    }
}

/// The limits, with the number of unstable roots between them counted.
fn confirmed(
    open_loop: &impl OpenLoop,
    rpm: f64,
    depth_mm: f64,
) -> Result<Vec<AxisCrossing>, StabilityError> {
    let broke_down = |depth_m: f64, what| StabilityError::BrokeDown {
        rpm,
        depth_mm: depth_m * 1e3,
        what,
    };
    let depth_m = depth_mm * 1e-3;
    let found = limits(open_loop, depth_m).ok_or(broke_down(depth_m, "receptances are not finite"))?;
    let mut outside =
        outside_at_no_depth(open_loop).ok_or(broke_down(0.0, "the roots at depth 0 cannot be counted"))?;
    for (index, limit) in found.iter().enumerate() {
        let count = limit.kind.count();
        outside += if limit.outward { count } else { -count };
        let next_m = found.get(index + 1).map_or(depth_m, |next| next.depth_m);
        // Between limits that are as good as one there is nothing to count.
        if next_m - limit.depth_m < 1e-6 * depth_m {
            continue;
        }
        let between_m = 0.5 * (limit.depth_m + next_m);
        if unstable_roots(open_loop, between_m, 0.0) != Some(outside) {
            return Err(broke_down(
                between_m,
                "the turns of the determinant do not confirm the crossings of the loci",
            ));
        }
    }
    Ok(found)
}

impl Method for Nyquist {
    fn name(&self) -> &'static str {
        "nyquist"
    }

    fn blind_to(&self) -> Option<&'static str> {
        (self.harmonics == 0).then_some("flips: averaged coefficients")
    }

    fn point(&self, rpm: f64, depth_mm: f64) -> Result<CutStability, StabilityError> {
        check_speed(rpm)?;
        check_depth(depth_mm)?;
        AveragedLoop::check_reach(&self.problem, depth_mm)?;
        if self.harmonics == 0 {
            return root::averaged_point(&self.problem, rpm, depth_mm, |problem| {
                AveragedLoop::new(problem, Some(rpm))
            });
        }
        let truncated = MultiFrequency {
            problem: self.problem.clone(),
            harmonics: Some(self.harmonics),
        };
        truncated.point(rpm, depth_mm)
    }

    fn line(&self, rpm: f64, depth_mm: f64, _samples: usize) -> Result<SpeedLine, StabilityError> {
        check_speed(rpm)?;
        check_depth(depth_mm)?;
        AveragedLoop::check_reach(&self.problem, depth_mm)?;
        if self.harmonics == 0 {
            let open_loop = self.averaged(rpm);
            let found = confirmed(&open_loop, rpm, depth_mm)?;
            let thinned = self.problem.thinned();
            let thinned = thinned
                .iter()
                .map(|problem| limits(&AveragedLoop::new(problem, Some(rpm)), depth_mm * 1e-3));
            let others: Vec<Vec<AxisCrossing>> = thinned.map(Option::unwrap_or_default).collect();
            return speed_line(&open_loop, rpm, depth_mm, &found, &others, hertz);
        }
        let open_loop = self.periodic(rpm);
        let found = confirmed(&open_loop, rpm, depth_mm)?;
        let finer = HarmonicLoop::new(&self.problem, rpm, 2 * self.harmonics + 1);
        let mut others = vec![limits(&finer, depth_mm * 1e-3).unwrap_or_default()];
        others.extend(open_loop.thinned_limits(depth_mm * 1e-3));
        speed_line(&open_loop, rpm, depth_mm, &found, &others, |limit| {
            open_loop.chatter_hz(limit)
        })
    }
}
