//! Traverse of the workpiece: air, entry, full engagement, exit, air.

use super::SimulateError;
use quietcut_model::cutter::Cutter;
use quietcut_model::spindle::Spindle;
use quietcut_numerics::roots::{bisection, minimum};

/// Traverse of the workpiece: entry, full engagement and exit of the tool. Times in s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WorkpieceTraverse {
    /// The tool never meets the workpiece.
    Air,
    /// Full engagement at all times; the surface at t = 0 is that of a tool at rest.
    Steady,
    /// The axial depth grows linearly for the time `ramp_s` from `start_s` on, and decreases linearly for the same time
    /// until `end_s`.
    Ramp {
        /// Time of the first contact of the tool with the workpiece, s.
        start_s: f64,
        /// Duration of the growth of the axial depth, and of its decrease, s.
        ramp_s: f64,
        /// Time of the last contact of the tool with the workpiece, s.
        end_s: f64,
    },
    /// The tool feeds in through the front face of the workpiece and out through its end face, so that the immersion
    /// grows and decreases. A tooth at the immersion angle φ cuts while its position R sin φ along the feed is between
    /// the two faces.
    Feed {
        /// Time at which the circle of the teeth touches the front face, s.
        start_s: f64,
        /// Time at which the circle of the teeth touches the end face, s.
        end_s: f64,
    },
}

/// The windows of time, at most two, in which a tooth has material in front of it during one passing, s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MaterialWindows {
    windows: [Option<[f64; 2]>; 2],
}

impl MaterialWindows {
    /// True if the time `t`, s, lies in one of the windows in which the tooth has material in front of it.
    pub fn contain(&self, t: f64) -> bool {
        self.windows
            .iter()
            .flatten()
            .any(|[from, to]| (*from..*to).contains(&t))
    }

    /// The first start or end of a window after `t`, s; infinite if there is none.
    pub fn next_edge(&self, t: f64) -> f64 {
        let edges = self.windows.iter().flatten().flatten();
        edges
            .copied()
            .filter(|edge| *edge > t)
            .fold(f64::INFINITY, f64::min)
    }
}

impl WorkpieceTraverse {
    /// Time, s, at the mean feed speed, from the instant at which the circle of the teeth touches the front face of the
    /// workpiece to full engagement; the exit through the end face takes as long.
    ///
    /// # Errors
    /// The tool has no diameter.
    pub fn entry_duration_s(cutter: &Cutter, spindle: &Spindle) -> Result<f64, SimulateError> {
        let radius_m = cutter.radius_m.ok_or(SimulateError::NoDiameter)?;
        // The tool is fully engaged when the last point of its engagement arc has passed the workpiece face: one of the
        // two ends of an arc within 0 to 180 degrees.
        let last = cutter.start_rad.sin().min(cutter.exit_rad.sin());
        Ok(radius_m * (1.0 - last) / feed_speed(cutter, spindle))
    }

    /// Fraction of the axial depth that is engaged at the time `t`, 0 to 1.
    pub fn depth_share(&self, t: f64) -> f64 {
        match *self {
            Self::Air => 0.0,
            Self::Steady | Self::Feed { .. } => 1.0,
            Self::Ramp {
                start_s,
                ramp_s,
                end_s,
            } => {
                let inside = (t - start_s).min(end_s - t);
                if inside <= 0.0 {
                    0.0
                } else if inside >= ramp_s {
                    1.0
                } else {
                    inside / ramp_s
                }
            }
        }
    }

    /// The first time after `t`, s, at which the rate of the axial depth may be discontinuous; infinite if there is
    /// none.
    pub fn next_knot(&self, t: f64) -> f64 {
        let Self::Ramp {
            start_s,
            ramp_s,
            end_s,
        } = *self
        else {
            return f64::INFINITY;
        };
        // If growth and decrease of the depth overlap, the rate also jumps halfway between start and end.
        let knots = [
            start_s,
            start_s + ramp_s,
            0.5 * (start_s + end_s),
            end_s - ramp_s,
            end_s,
        ];
        knots
            .into_iter()
            .filter(|knot| *knot > t)
            .fold(f64::INFINITY, f64::min)
    }

    /// True if the tool does not meet the workpiece any more from the time `t`, s, on.
    pub fn is_over(&self, t: f64, cutter: &Cutter, spindle: &Spindle) -> bool {
        match *self {
            Self::Air => true,
            Self::Steady => false,
            Self::Ramp { end_s, .. } => t >= end_s,
            Self::Feed { end_s, .. } => {
                let radius_m = cutter.radius_m.unwrap_or(0.0);
                // Feed during one further revolution, m, in which every tooth completes its last passing.
                let revolution_feed_m = cutter.feed_per_tooth_m * cutter.teeth.len() as f64;
                (t - end_s) * feed_speed(cutter, spindle) > radius_m + revolution_feed_m
            }
        }
    }

    /// The times at which a tooth has material in front of it, if it passes the start angle at `open_s` and the exit
    /// angle at `close_s`, s.
    pub fn windows(&self, cutter: &Cutter, spindle: &Spindle, open_s: f64, close_s: f64) -> MaterialWindows {
        let whole = Some([open_s, close_s]);
        match *self {
            Self::Air => MaterialWindows::default(),
            Self::Steady => MaterialWindows {
                windows: [whole, None],
            },
            Self::Ramp { start_s, end_s, .. } => MaterialWindows {
                windows: [intersection(whole, Some([start_s, end_s])), None],
            },
            Self::Feed { start_s, end_s } => {
                let radius_m = cutter.radius_m.unwrap_or(f64::INFINITY);
                let speed = feed_speed(cutter, spindle) / radius_m;
                let opened_rad = spindle.angle_rad(open_s);
                let sin = |t: f64| (cutter.start_rad + (spindle.angle_rad(t) - opened_rad)).sin();
                let window = [open_s, close_s];
                // sin φ minus (position of a face)/R is positive where the tooth is beyond that face. This difference
                // is taken as concave in t: the spindle speed varies slowly compared with a tooth passing.
                let behind_front = positive(|t| sin(t) - (1.0 - speed * (t - start_s)), window);
                let behind_end = positive(|t| sin(t) - (1.0 - speed * (t - end_s)), window);
                let [before, after] = complement(behind_end, window);
                MaterialWindows {
                    windows: [
                        intersection(behind_front, before),
                        intersection(behind_front, after),
                    ],
                }
            }
        }
    }
}

/// Feed speed of the tool, m/s: the feed per tooth times the tooth-passing frequency at the mean spindle speed.
fn feed_speed(cutter: &Cutter, spindle: &Spindle) -> f64 {
    cutter.feed_per_tooth_m * cutter.teeth.len() as f64 * spindle.speed_rad_per_s() / std::f64::consts::TAU
}

fn intersection(a: Option<[f64; 2]>, b: Option<[f64; 2]>) -> Option<[f64; 2]> {
    let ([a0, a1], [b0, b1]) = (a?, b?);
    let both = [a0.max(b0), a1.min(b1)];
    (both[0] < both[1]).then_some(both)
}

/// The parts of `window` before and after the subinterval `excluded`, each `None` if empty; without `excluded` the
/// whole `window` and `None`.
fn complement(excluded: Option<[f64; 2]>, window: [f64; 2]) -> [Option<[f64; 2]>; 2] {
    match excluded {
        None => [Some(window), None],
        Some([from, to]) => [
            (window[0] < from).then_some([window[0], from]),
            (to < window[1]).then_some([to, window[1]]),
        ],
    }
}

/// The window within [`from`, `to`] in which the concave function `f` is positive; `None` if there is none.
fn positive(f: impl Fn(f64) -> f64, [from, to]: [f64; 2]) -> Option<[f64; 2]> {
    let top = minimum([from, to], 0.0, |x| -f(x));
    if f(top) <= 0.0 {
        return None;
    }
    // The bound of the bisection at which the concave function `f` is positive, so that the window does not exceed the
    // range of positive values.
    let root = |negative: f64| {
        let [_, positive] = bisection([negative, top], 0.0, |x| {
            let is_positive = f(x) > 0.0;
            !is_positive
        });
        positive
    };
    let left = if f(from) >= 0.0 { from } else { root(from) };
    let right = if f(to) >= 0.0 { to } else { root(to) };
    Some([left, right])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::{acetal_cutter, slot_cutter};

    #[test]
    fn immersion_grows_as_the_tool_feeds_in_and_shrinks_as_it_feeds_out() {
        for cutter in [acetal_cutter(), slot_cutter()] {
            let spindle = Spindle::new(900.0);
            let radius_m = 6.35e-3;
            let feed_m_per_s = 0.15e-3 * 30.0;
            let (start_s, end_s) = (1.0, 5.0);
            let traverse = WorkpieceTraverse::Feed { start_s, end_s };
            let revolution_s = 60.0 / 900.0;
            for pass in 0..120 {
                let open_s = f64::from(pass) * revolution_s + cutter.start_rad / spindle.speed_rad_per_s();
                let close_s = f64::from(pass) * revolution_s + cutter.exit_rad / spindle.speed_rad_per_s();
                let windows = traverse.windows(&cutter, &spindle, open_s, close_s);
                // The geometric condition, evaluated at many instants.
                for i in 0..500 {
                    let t = open_s + (close_s - open_s) * (f64::from(i) + 0.5) / 500.0;
                    let x_m = radius_m * spindle.angle_rad(t).sin();
                    let front_m = radius_m - feed_m_per_s * (t - start_s);
                    let end_m = radius_m - feed_m_per_s * (t - end_s);
                    // Points within rounding of a face are not compared.
                    if (x_m - front_m).abs() > 1e-9 && (x_m - end_m).abs() > 1e-9 {
                        assert_eq!(
                            windows.contain(t),
                            x_m > front_m && x_m < end_m,
                            "pass {pass}, {t} s"
                        );
                    }
                }
            }
            let entry_s = WorkpieceTraverse::entry_duration_s(&cutter, &spindle).unwrap();
            assert!((entry_s - radius_m / feed_m_per_s).abs() < 1e-12);
            assert!(!traverse.is_over(end_s + entry_s, &cutter, &spindle));
            assert!(traverse.is_over(end_s + 2.0 * entry_s, &cutter, &spindle));
        }
    }

    #[test]
    fn the_depth_of_a_ramp_grows_linearly_to_its_full_value_and_back() {
        let ramp = WorkpieceTraverse::Ramp {
            start_s: 1.0,
            ramp_s: 0.5,
            end_s: 4.0,
        };
        let shares = [0.5, 1.0, 1.25, 1.5, 2.0, 3.75, 4.0, 5.0].map(|t| ramp.depth_share(t));
        assert_eq!(shares, [0.0, 0.0, 0.5, 1.0, 1.0, 0.5, 0.0, 0.0]);
        assert_eq!(ramp.next_knot(1.2), 1.5);
        assert_eq!(ramp.next_knot(4.0), f64::INFINITY);
    }
}
