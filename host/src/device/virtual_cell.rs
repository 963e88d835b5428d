//! The virtual robot cell: what the simulated device hears where nothing else is asked for.

use std::path::Path;
use std::sync::mpsc::{Receiver, sync_channel};

use crate::case::{Case, CaseError};
use crate::simulate::{Accelerometer, Heard, TachometerModel, VirtualCut, VirtualCutError};

/// The case file of the cell, part of the program so that it needs no other file.
const CASE_NAME: &str = "tests/cases/kuka-kr90-acetal.toml";
const CASE_TEXT: &str = include_str!("../../../tests/cases/kuka-kr90-acetal.toml");

/// The sample clock of the virtual sensor runs this much too fast: a real one is off by up to 3 %.
const CLOCK_ERROR: f64 = 0.01;

/// The spindle turns this long before and after the tool is in the workpiece: what one cut made has died out before the
/// next begins.
const AIR_SECONDS: f64 = 1.0;

/// A milling robot with its tool over a block of acetal.
#[derive(Clone, Debug)]
pub struct VirtualCell {
    case: Case,
}

impl VirtualCell {
    /// The KUKA KR90 of the case files.
    ///
    /// # Errors
    /// None that a test does not find: the case is part of the program.
    pub fn new() -> Result<Self, CaseError> {
        Ok(Self {
            case: Case::parse(Path::new(CASE_NAME), CASE_TEXT)?,
        })
    }

    /// Structure, tool, material and cut.
    pub fn case(&self) -> &Case {
        &self.case
    }

    /// Number of teeth of its tool.
    ///
    /// # Errors
    /// None that a test does not find.
    pub fn teeth(&self) -> Result<u8, CaseError> {
        // More teeth than a device can count are for the device to refuse.
        Ok(u8::try_from(self.case.tool()?.teeth).unwrap_or(u8::MAX))
    }

    /// What the sensor hears of a cut, entry and exit and the air before and behind included; `seed` makes its noise
    /// repeat.
    ///
    /// # Errors
    /// Where the cut is shorter than entry and exit, or cannot be simulated.
    pub fn cut(
        &self,
        spindle_rpm: f64,
        depth_mm: f64,
        seconds: f64,
        seed: u64,
    ) -> Result<Heard, VirtualCutError> {
        let accelerometer = Accelerometer {
            clock_error: CLOCK_ERROR,
            ..Accelerometer::IIS3DWB_16G
        };
        virtual_cut(spindle_rpm, depth_mm, seconds).hear(
            &self.case,
            accelerometer,
            TachometerModel::ONE_MARK,
            seed,
        )
    }

    /// From when to when the tool of such a cut is in the workpiece in full, in seconds since the first sample.
    ///
    /// # Errors
    /// As [`cut`](Self::cut).
    pub fn full_cut_s(
        &self,
        spindle_rpm: f64,
        depth_mm: f64,
        seconds: f64,
    ) -> Result<[f64; 2], VirtualCutError> {
        virtual_cut(spindle_rpm, depth_mm, seconds).full_cut_s(&self.case)
    }

    /// Cut after cut without end, computed while the one before is heard: period doubling, a quiet cut, a Hopf.
    pub fn cuts_for_ever(self) -> Receiver<Heard> {
        const CUTS: [(f64, f64); 3] = [(1045.0, 2.0), (1045.0, 1.0), (900.0, 2.0)];
        const SECONDS: f64 = 12.0;
        let (send, receive) = sync_channel(1);
        std::thread::spawn(move || {
            for (seed, (spindle_rpm, depth_mm)) in (1..).zip(CUTS.into_iter().cycle()) {
                let Ok(heard) = self.cut(spindle_rpm, depth_mm, SECONDS, seed) else {
                    return;
                };
                // Nobody listens any more.
                if send.send(heard).is_err() {
                    return;
                }
            }
        });
        receive
    }
}

fn virtual_cut(spindle_rpm: f64, depth_mm: f64, seconds: f64) -> VirtualCut {
    VirtualCut {
        air_s: AIR_SECONDS,
        ..VirtualCut::new(spindle_rpm, depth_mm, seconds)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn its_cuts_can_be_made() {
        let cuts = VirtualCell::new().unwrap().cuts_for_ever();
        for _ in 0..3 {
            assert!(cuts.recv().unwrap().blocks.len() > 1000);
        }
    }
}
