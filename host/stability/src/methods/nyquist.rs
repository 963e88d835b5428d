//! The Nyquist criterion: unstable roots from the winding of a determinant, limits from the characteristic loci.

use super::multi_frequency::MultiFrequency;
use crate::error::{NOT_FINITE, StabilityError};
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

/// Generalized Nyquist criterion (MacFarlane & Postlethwaite) on modelled or measured receptances.
///
/// With averaged coefficients (K = 0) the line s = iω from 0 to infinity suffices, and the criterion is exact for the
/// averaged cut. With K > 0 the coefficients are periodic: s runs from 0 to iΩ/2, with the determinant of the harmonic
/// transfer matrix with harmonics up to K (Wereley & Hall); the only error beside that of a table is truncation.
/// Between every two limits, and behind the last, the number of unstable roots is verified by a count that does not use
/// the loci, unless the depth interval is too short.
#[derive(Clone, Debug)]
pub struct Nyquist {
    /// Receptances and cutting process.
    pub problem: FrequencyProblem,
    /// Highest harmonic K of the vibration in the harmonic transfer matrix; 0 uses averaged directional coefficients
    /// instead.
    pub harmonics: usize,
}

impl Nyquist {
    /// Number of unstable roots at a spindle speed (rev/min) and an axial depth (mm); a complex pair counts as 2.
    ///
    /// # Errors
    /// Speed not positive, depth negative, one of them not finite, a table of receptances that ends too early for this
    /// depth, or roots that cannot be counted, for example at a limit.
    pub fn unstable_roots(&self, rpm: f64, depth_mm: f64) -> Result<i32, StabilityError> {
        check_speed(rpm)?;
        check_depth(depth_mm)?;
        AveragedLoop::check_reach(&self.problem, rpm, depth_mm)?;
        let depth_m = depth_mm * 1e-3;
        let count = if self.harmonics == 0 {
            unstable_roots(&self.averaged(rpm), depth_m, 0.0)
        } else {
            unstable_roots(&self.periodic(rpm), depth_m, 0.0)
        };
        count.ok_or(StabilityError::BrokeDown {
            rpm,
            depth_mm,
            what: "the revolutions of the determinant about the origin cannot be counted",
        })
    }

    fn averaged(&self, rpm: f64) -> AveragedLoop<'_> {
        AveragedLoop::new(&self.problem, Some(rpm))
    }

    fn periodic(&self, rpm: f64) -> HarmonicLoop<'_> {
        HarmonicLoop::new(&self.problem, rpm, self.harmonics)
    }
}

/// Stability limits up to an axial depth, mm. Between every two of them, and behind the last, a count of unstable roots
/// must agree with the crossings of the real axis by the characteristic loci, unless the depth interval is too short.
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
    let found = limits(open_loop, depth_m).map_err(|cause| cause.at(rpm, depth_mm, NOT_FINITE))?;
    let mut outside =
        outside_at_no_depth(open_loop).ok_or(broke_down(0.0, "the roots at depth 0 cannot be counted"))?;
    for (index, limit) in found.iter().enumerate() {
        let count = limit.kind.count();
        outside += if limit.outward { count } else { -count };
        let next_m = found.get(index + 1).map_or(depth_m, |next| next.depth_m);
        // Two limits closer than 1e-6 of the last depth, or a limit that close to it, leave no interval in which roots
        // could be counted.
        if next_m - limit.depth_m < 1e-6 * depth_m {
            continue;
        }
        let between_m = 0.5 * (limit.depth_m + next_m);
        if unstable_roots(open_loop, between_m, 0.0) != Some(outside) {
            return Err(broke_down(
                between_m,
                "the revolutions of the determinant about the origin do not confirm the crossings of the loci",
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
        AveragedLoop::check_reach(&self.problem, rpm, depth_mm)?;
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
        AveragedLoop::check_reach(&self.problem, rpm, depth_mm)?;
        if self.harmonics == 0 {
            let open_loop = self.averaged(rpm);
            let found = confirmed(&open_loop, rpm, depth_mm)?;
            let thinned = self.problem.thinned();
            let thinned = thinned
                .iter()
                .map(|problem| limits(&AveragedLoop::new(problem, Some(rpm)), depth_mm * 1e-3));
            let others: Vec<Vec<AxisCrossing>> = thinned.map(Result::unwrap_or_default).collect();
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
