//! `monitor --web`: the received state as a page that a browser shows, live over a WebSocket.
//!
//! The thread of the program takes the news of the device and publishes the newest state; it never waits for a browser.
//! A second thread serves pages and sockets. Each socket sends the newest state as soon as the one before is sent, so
//! that a slow browser misses old states and no state waits in a queue.
//!
//! | file | content |
//! |---|---|
//! | `address` | the address of the page, from the command line |
//! | `error` | why the page cannot be shown |
//! | `access` | who may see the page |
//! | `frames` | the received state as texts for the page |
//! | `socket` | sends these texts to one browser |
//! | `routes` | the page and the socket, with their checks |
//! | `server` | the thread that accepts a bounded number of connections |
//! | `show` | the loop over news and published states |
//! | `page.html`, `page.css`, `page.js`, `charts.js` | the page, which loads nothing else |

mod access;
mod address;
mod error;
mod frames;
mod routes;
mod server;
mod show;
mod socket;

pub(crate) use address::WebAddress;
pub(crate) use error::WebError;
pub(crate) use server::Server;
pub(crate) use show::show;
