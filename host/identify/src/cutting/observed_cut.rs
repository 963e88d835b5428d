//! Trial cuts with the observed side of the stability limit: chatter or stable.

use quietcut_recording::cut_table::{Outcome, TrialCut};

/// A trial cut with its observed outcome: chatter or stable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObservedCut {
    /// Spindle speed, rev/min.
    pub rpm: f64,
    /// Axial depth, mm.
    pub depth_mm: f64,
    /// True if the cut chattered.
    pub chatters: bool,
    /// Chatter frequency, Hz; `None` for a stable cut, or if it was not measured.
    pub chatter_hz: Option<f64>,
}

impl ObservedCut {
    /// Reads one row of a table of trial cuts; `None` for a marginal cut, which may lie on either side of the stability
    /// limit.
    pub fn new(cut: &TrialCut) -> Option<Self> {
        Some(Self {
            rpm: cut.rpm,
            depth_mm: cut.depth_mm,
            chatters: match cut.outcome {
                Outcome::Stable => false,
                Outcome::Chatter => true,
                Outcome::Marginal => return None,
            },
            chatter_hz: cut.chatter_hz,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use quietcut_recording::cut_table::parse;
    use std::path::Path;

    #[test]
    fn observations_are_taken_from_both_heads_and_marginal_cuts_are_none() {
        let observed = |text: &str| {
            let cuts = parse(Path::new("cuts.csv"), text).unwrap();
            cuts.iter().map(ObservedCut::new).collect::<Vec<_>>()
        };
        let cut = |depth_mm, chatters, chatter_hz| {
            Some(ObservedCut {
                rpm: 900.0,
                depth_mm,
                chatters,
                chatter_hz,
            })
        };
        assert_eq!(
            observed("rpm,depth_mm,chatter_hz,verdict\n900,1.5,,stable\n900,1.7,17.4,hopf\n"),
            [cut(1.5, false, None), cut(1.7, true, Some(17.4))]
        );
        assert_eq!(
            observed("rpm [rev/min],depth [mm],outcome\n900,1.5,marginal\n900,1.7,chatter\n"),
            [None, cut(1.7, true, None)]
        );
    }
}
