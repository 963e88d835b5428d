//! `monitor` on a terminal: the state of the device as a picture that is drawn anew a few times a second.
//!
//! | file | content |
//! |---|---|
//! | `heard` | everything that the device has sent so far; knows neither terminal nor port |
//! | `spectrum` | one spectrum, put together from its chunks |
//! | `lobes` | the lobe table over speed and depth, and the margin of a cut in it |
//! | `link` | the thread that listens to the device, and connects again after the cable was pulled |
//! | `choices` | the view that the user has chosen by keys |
//! | `view` | draws what was heard |
//! | `screen` | the loop over news, keys and pictures |

mod choices;
mod heard;
mod link;
mod lobes;
pub(crate) mod screen;
mod spectrum;
mod view;

#[cfg(test)]
mod tests;
