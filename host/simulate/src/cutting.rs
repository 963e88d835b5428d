//! The cutting process of one simulated cut.

use super::pores::Pores;
use super::workpiece_traverse::WorkpieceTraverse;
use quietcut_model::{Cutter, Spindle};

/// The cutting process of one simulated cut: cutter, spindle, traverse of the workpiece, regeneration and pores.
#[derive(Clone, Debug)]
pub struct Cutting {
    /// Geometry of the teeth, engagement and cutting force law of the tool.
    pub cutter: Cutter,
    /// Spindle angle over time.
    pub spindle: Spindle,
    /// Entry of the tool into the workpiece, full engagement, and exit.
    pub traverse: WorkpieceTraverse,
    /// Earlier vibration of the tool that the chip thickness contains: that of all tooth passings, of the last one, or
    /// none.
    pub regeneration: Regeneration,
    /// Pores of the workpiece material; `None` for solid material.
    pub pores: Option<Pores>,
}

/// The earlier vibration that the chip thickness includes (regenerative effect).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Regeneration {
    /// All earlier tooth passings (multiple regeneration): a tooth that does not reach the surface they left has no
    /// force (thesis eqs 6.20 to 6.27).
    AllPasses,
    /// The last tooth passing only; every tooth in material counts as in contact, even where its chip thickness is
    /// negative. This is the delay model of stability charts.
    LastPass,
    /// No vibration at all: the chip thickness is that of feed and runout.
    None,
}
