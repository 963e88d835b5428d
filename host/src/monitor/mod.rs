//! `monitor` on a terminal: the state of the device as a picture that is drawn anew a few times a second.
//!
//! | file | content |
//! |---|---|
//! | `received` | everything that the device has sent so far; knows neither terminal nor port |
//! | `spectrum` | one spectrum, put together from its chunks |
//! | `lobes` | the lobe table over speed and depth, and the margin of a cut in it |
//! | `link` | the thread that listens to the device, and connects again after the cable was pulled |
//! | `choices` | the view that the user has chosen by keys |
//! | `view` | draws the received state |
//! | `screen` | the loop over news, keys and pictures |

mod choices;
mod link;
mod lobes;
mod received;
pub(crate) mod screen;
mod spectrum;
mod view;

#[cfg(test)]
mod tests;
