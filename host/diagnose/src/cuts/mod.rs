//! Diagnosis of stable cuts on their orbit: what a cut knows is reduced once to orders, and every machine is compared by
//! the orders of its forced periodic orbit.
//!
//! | file | content |
//! |---|---|
//! | `record`, `amplitude_errors` | a recorded cut, reduced; the errors of its orders |
//! | `jumps`, `wander`, `scatter` | what errors of the spindle angle and the speed, and the scatter of tooth forces, leave in its orders |
//! | `conditions`, `machine`, `reading` | a machine in a cut; the orders of its channels |
//! | `candidate`, `restoring_candidates`, `candidates` | effects with their widths |
//! | `space` | variables of a fit |
//! | `moment` | the orbit of a machine, and its derivatives |
//! | `fit` | fit of a machine |
//! | `selection` | sets of effects by their evidence |
//! | `contradictions` | another tool, engagement or wiring of channels than given |
//! | `answer`, `views` | the answer, with its pictures |
//! | `diagnosis` | the entry |

mod amplitude_errors;
mod answer;
mod candidate;
mod candidates;
mod conditions;
mod contradictions;
pub(crate) mod diagnosis;
mod fit;
mod jumps;
mod machine;
mod moment;
mod no_tachometer;
mod reading;
mod record;
mod restoring_candidates;
mod scatter;
mod selection;
mod space;
#[cfg(test)]
mod tests;
mod views;
mod wander;
