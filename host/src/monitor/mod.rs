//! `monitor` as a picture on a terminal, which is drawn anew a few times a second, and as a page in a browser.
//!
//! | file | content |
//! |---|---|
//! | `received` | everything that the device has sent so far; knows neither terminal nor port |
//! | `spectrum` | one spectrum, put together from its chunks |
//! | `lobes` | the lobe table over speed and depth, and the margin of a cut in it |
//! | `sentences` | the received state in words |
//! | `link` | the thread that receives from the device, and connects again after the cable was pulled |
//! | `live` | the received state, kept up to date by that thread |
//! | `choices` | the view that the user has chosen by keys |
//! | `view` | draws the received state |
//! | `screen` | the loop over news, keys and pictures |
//! | `web` | the page |

mod choices;
mod link;
pub(crate) mod live;
mod lobes;
pub(crate) mod received;
pub(crate) mod screen;
mod sentences;
mod spectrum;
mod view;
pub(crate) mod web;

#[cfg(test)]
mod tests;
