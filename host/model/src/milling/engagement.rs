//! Engagement of the teeth over one tooth-passing period.

use std::f64::consts::PI;

use super::{Cut, Tool};

/// Length of a subinterval of the tooth-passing period, as a fraction of the pitch angle, below which the subinterval
/// is dropped: it comes from rounding of angles in degrees. The value lies far above the rounding of a double, 2e-16,
/// and far below the digits of a case file.
const NEGLIGIBLE: f64 = 1e-9;

/// The teeth that cut during one tooth-passing period of a tool with equal pitch.
///
/// The tooth-passing period starts when a tooth enters. At phase ψ from 0 to the pitch angle θ, tooth k is at the
/// immersion angle start + kθ + ψ, and cuts while that angle is below the exit angle. The period therefore has two
/// subintervals: in the first, one more tooth cuts than in the second. The first subinterval may be empty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Engagement {
    /// Immersion angle of entry, rad.
    pub start: f64,
    /// Immersion angle of exit, rad.
    pub exit: f64,
    /// Pitch angle θ, rad.
    pub pitch: f64,
}

/// A subinterval of the tooth-passing period with a constant number of teeth in cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Subinterval {
    /// Phase of the tooth-passing period at the start of the subinterval, rad.
    pub from: f64,
    /// Phase of the tooth-passing period at the end of the subinterval, rad.
    pub to: f64,
    /// Number of teeth in cut during the subinterval; 0 means free vibration.
    pub teeth: usize,
}

impl Engagement {
    /// The engagement of a tool with equal pitch in a cut: start, exit and pitch angle.
    pub fn new(tool: &Tool, cut: &Cut) -> Self {
        Self {
            start: cut.start_deg.to_radians(),
            exit: cut.exit_deg.to_radians(),
            pitch: 2.0 * PI / tool.teeth as f64,
        }
    }

    /// The subintervals of one tooth-passing period that are not empty, in the order of the phase; together they cover
    /// [0, θ].
    pub fn subintervals(&self) -> Vec<Subinterval> {
        let pitches = (self.exit - self.start) / self.pitch;
        let mut always = pitches.floor();
        let mut rest = pitches - always;
        if rest < NEGLIGIBLE {
            rest = 0.0;
        } else if rest > 1.0 - NEGLIGIBLE {
            always += 1.0;
            rest = 0.0;
        }
        let switch = rest * self.pitch;
        // The number of teeth that cut all the time is small and not negative.
        let always = always as usize;
        let mut subintervals = Vec::with_capacity(2);
        if switch > 0.0 {
            subintervals.push(Subinterval {
                from: 0.0,
                to: switch,
                teeth: always + 1,
            });
        }
        subintervals.push(Subinterval {
            from: switch,
            to: self.pitch,
            teeth: always,
        });
        subintervals
    }

    /// Immersion angle, rad, of tooth number `tooth` in cut at the phase `phase` of the tooth-passing period, rad.
    /// Tooth 0 enters at the start of this period, tooth k has entered k periods before.
    pub fn angle(&self, tooth: usize, phase: f64) -> f64 {
        self.start + tooth as f64 * self.pitch + phase
    }

    /// Mean number of teeth in cut: the engaged fraction of a revolution times the number of teeth.
    pub fn mean_teeth(&self) -> f64 {
        (self.exit - self.start) / self.pitch
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn engagement(teeth: usize, start_deg: f64, exit_deg: f64) -> Engagement {
        Engagement {
            start: start_deg.to_radians(),
            exit: exit_deg.to_radians(),
            pitch: 2.0 * PI / teeth as f64,
        }
    }

    #[test]
    fn intervals_fill_the_period_and_hold_the_mean_number_of_teeth() {
        for teeth in 1..=12 {
            for (start, exit) in [
                (0.0, 180.0),
                (90.0, 180.0),
                (0.0, 37.0),
                (154.2, 180.0),
                (60.0, 120.0),
            ] {
                let engagement = engagement(teeth, start, exit);
                let subintervals = engagement.subintervals();
                let mut end = 0.0;
                let mut sum = 0.0;
                for subinterval in &subintervals {
                    assert_eq!(subinterval.from, end);
                    assert!(subinterval.to > subinterval.from);
                    end = subinterval.to;
                    sum += subinterval.teeth as f64 * (subinterval.to - subinterval.from);
                }
                assert_eq!(end, engagement.pitch);
                // Rounding of a few operations on angles below 2π.
                assert!((sum / engagement.pitch - engagement.mean_teeth()).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn two_teeth_at_full_immersion_cut_all_the_time_one_by_one() {
        let subintervals = engagement(2, 0.0, 180.0).subintervals();
        assert_eq!(subintervals.len(), 1);
        assert_eq!(subintervals[0].teeth, 1);
        let half = engagement(2, 90.0, 180.0).subintervals();
        assert_eq!((half[0].teeth, half[1].teeth), (1, 0));
        assert!((half[0].to - PI / 2.0).abs() < 1e-15);
    }
}
