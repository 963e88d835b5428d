//! A turning tool on its way through a workpiece.

use super::passage::Passage;
use super::pores::Pores;
use quietcut_model::{Cutter, Spindle};

/// A turning tool on its way through a workpiece.
#[derive(Clone, Debug)]
pub struct Cutting {
    /// The tool.
    pub cutter: Cutter,
    /// How it turns.
    pub spindle: Spindle,
    /// How it comes into the workpiece and out.
    pub passage: Passage,
    /// What a tooth finds in front of it.
    pub regeneration: Regeneration,
    /// Pores of the material; `None` where it is solid.
    pub pores: Option<Pores>,
}

/// Which earlier vibration a chip feels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Regeneration {
    /// That of all earlier passes: the surface is what they left, and a tooth that does not reach it feels no force.
    AllPasses,
    /// That of the last pass alone, and a chip of negative thickness pulls: the linear model of stability charts.
    LastPass,
    /// None, nor that of the tooth itself: the chip is that of the feed (and of runout), and the motion is the forced one
    /// that every stable cut comes to.
    None,
}
