//! Verdict, table and limits of the machine to the next speed or depth.
//!
//! With a table: the speed nearest in relative change that is *quiet* at the present depth, that is, stable for
//! all depths within [`DEPTH_MARGIN`] and all speeds within [`SPEED_BAND`] of it. Where there is none: the largest quiet
//! depth at the present speed, or at another one where it is [`BETTER`] times that.
//!
//! Without a table, or where it knows nothing of the cut, or where it contradicts what is heard: the tooth-passing rule,
//! [`tooth_passing_speed`]. Advice says which of the two it rests on, and why not on the better one.
//!
//! Without a working point the first layer of the table is assumed, and the least depth at which the table has the
//! chatter that is heard: a cut that chatters is at least that deep. Deeper cuts take a second step.

mod advise;
mod cell;
mod depth;
mod margins;
mod proposal;
mod quiet_speed_search;
mod rule;

pub use advise::advise;
pub use margins::{BETTER, DEPTH_MARGIN, SPEED_BAND};
pub use proposal::{Action, Advice, Obstacle, Source};
pub use rule::{MAX_LOBE, tooth_passing_speed};
