//! Reasons why the page cannot be shown, each with what would be right.

use std::io;
use std::net::SocketAddr;

/// Reason why the page cannot be shown.
#[derive(Debug, thiserror::Error)]
pub(crate) enum WebError {
    /// The address cannot be used.
    #[error("--web {address}: {}", hint(cause))]
    Bind {
        /// Requested address.
        address: SocketAddr,
        /// Error of the operating system.
        cause: io::Error,
    },
    /// The thread of the server cannot be started.
    #[error("the page cannot be served: {0}")]
    Server(#[from] io::Error),
    /// The operating system gives no random numbers for the token.
    #[error(
        "no random token can be made: {cause}; leave the address out to show the page on this computer only"
    )]
    Random {
        /// Reason of the operating system.
        cause: String,
    },
}

/// Reason why an address cannot be used, and an address that would be right.
fn hint(cause: &io::Error) -> String {
    match cause.kind() {
        io::ErrorKind::AddrInUse => {
            "another program uses this port; state another one, or none for a free one: --web".into()
        }
        io::ErrorKind::AddrNotAvailable => {
            "this computer does not have this address; 0.0.0.0 stands for all that it has".into()
        }
        io::ErrorKind::PermissionDenied => {
            "this port needs the rights of an administrator; state one above 1023, such as 8080".into()
        }
        _ => format!("{cause}; a right address is 127.0.0.1:8080"),
    }
}
