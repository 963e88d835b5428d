//! Virtual robot cell: default source of the samples of the simulated device.

use std::path::Path;
use std::sync::mpsc::{Receiver, sync_channel};

use crate::case::{Case, CaseError};
use crate::simulate::{Accelerometer, SensedCut, TachometerModel, VirtualCut, VirtualCutError};

/// Path of the case file of the cell; the program contains its text.
const CASE_NAME: &str = "tests/cases/kuka-kr90-acetal.toml";
const CASE_TEXT: &str = include_str!("../../../tests/cases/kuka-kr90-acetal.toml");

/// Relative error of the sample clock of the virtual sensor: a choice within the 3 % of the real sensor.
const CLOCK_ERROR: f64 = 0.01;

/// Time in air before and after each cut, s: a choice that lets the vibration of one cut decay before the next.
const AIR_SECONDS: f64 = 1.0;

/// Virtual cell: a milling robot with a tool and a block of acetal.
#[derive(Clone, Debug)]
pub struct VirtualCell {
    case: Case,
}

impl VirtualCell {
    /// Loads the case of the milling robot KUKA KR90.
    ///
    /// # Errors
    /// The case is invalid; a test excludes this, because the case is part of the program.
    pub fn new() -> Result<Self, CaseError> {
        Ok(Self {
            case: Case::parse(Path::new(CASE_NAME), CASE_TEXT)?,
        })
    }

    /// Case of the cell: structure, tool, material and cut.
    pub fn case(&self) -> &Case {
        &self.case
    }

    /// Number of teeth of the tool.
    ///
    /// # Errors
    /// The case has no tool; a test excludes this.
    pub fn teeth(&self) -> Result<u8, CaseError> {
        // More than 255 teeth are stated as 255, which the device refuses.
        Ok(u8::try_from(self.case.tool()?.teeth).unwrap_or(u8::MAX))
    }

    /// Simulates the sensor samples of a cut with entry, exit and time in air; `seed` sets the sensor noise.
    ///
    /// # Errors
    /// The cut is shorter than entry and exit, or cannot be simulated.
    pub fn cut(
        &self,
        spindle_rpm: f64,
        depth_mm: f64,
        seconds: f64,
        seed: u64,
    ) -> Result<SensedCut, VirtualCutError> {
        let accelerometer = Accelerometer {
            clock_error: CLOCK_ERROR,
            ..Accelerometer::IIS3DWB_16G
        };
        virtual_cut(spindle_rpm, depth_mm, seconds).sense(
            &self.case,
            accelerometer,
            TachometerModel::ONE_MARK,
            seed,
        )
    }

    /// Start and end of full engagement of the cut that [`cut`](Self::cut) simulates, s since the first sample.
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

    /// Sequence that repeats three cuts without end: period doubling, stable, Hopf. Cuts are computed while earlier
    /// ones are played. The sequence ends if a cut cannot be simulated.
    pub fn endless_cuts(self) -> Receiver<SensedCut> {
        const CUTS: [(f64, f64); 3] = [(1045.0, 2.0), (1045.0, 1.0), (900.0, 2.0)];
        const SECONDS: f64 = 12.0;
        let (send, receive) = sync_channel(1);
        std::thread::spawn(move || {
            for (seed, (spindle_rpm, depth_mm)) in (1..).zip(CUTS.into_iter().cycle()) {
                let sensed = match self.cut(spindle_rpm, depth_mm, SECONDS, seed) {
                    Ok(sensed) => sensed,
                    Err(error) => {
                        tracing::error!("the virtual cell makes no more cuts: {error}");
                        return;
                    }
                };
                // Sending fails after the device has been dropped.
                if send.send(sensed).is_err() {
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
    fn cuts_of_the_virtual_cell_can_be_simulated() {
        let cuts = VirtualCell::new().unwrap().endless_cuts();
        for _ in 0..3 {
            assert!(cuts.recv().unwrap().blocks.len() > 1000);
        }
    }
}
