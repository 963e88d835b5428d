//! Advice: the next spindle speed or axial depth, from the verdict, the lobe table and the limits of the machine.
//!
//! A point (speed, depth) is *quiet* if the table is stable at all depths within [`DEPTH_MARGIN`] and at all speeds
//! within [`SPEED_BAND`] of it that the machine allows. Advice follows this order:
//!
//! 1. *Table, same depth*: the quiet speed with the smallest relative change from the present speed.
//! 2. *Table, smaller depth*: the largest quiet depth at the present speed. Another speed is advised only if its
//!    quiet depth is larger by the factor [`BETTER`], or if no depth is quiet at the present speed.
//! 3. *Tooth-passing rule* ([`tooth_passing_speed`]): used if the table gives no advice: for example, without a
//!    table, for a cut outside the table, or if the table contradicts the detected chatter.
//!
//! [`Advice::source`] names the source, [`Advice::obstacle`] the reason why no better source was used or no
//! speed is proposed.
//!
//! If no working point is set, advice assumes the first layer of the table and the smallest depth at which the table
//! has chatter of the detected kind at the present speed, else of any kind. If the table is right, the real cut is at
//! least that deep, so that a deeper cut may need a second step.

mod advise;
mod cell;
mod depth;
mod proposal;
mod quiet_speed_search;
mod rule;

pub use advise::advise;
pub use proposal::{Action, Advice, Obstacle, Source};
pub use rule::tooth_passing_speed;

pub use crate::criteria::{BETTER, DEPTH_MARGIN, MAX_LOBE, SPEED_BAND};
