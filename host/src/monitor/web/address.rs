//! The address of the page, from the command line.

use std::fmt;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::str::FromStr;

/// Address and port at which the page is served.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct WebAddress(SocketAddr);

/// This computer only, at a free port.
const LOOPBACK: SocketAddr = SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 0);

/// The text is no address.
#[derive(Debug, thiserror::Error)]
#[error(
    "`{text}` is no address: state a port such as 8080, or an address with or without one, such as 127.0.0.1:8080; \
     the port of the device stands before --web"
)]
pub(crate) struct NoAddress {
    text: String,
}

impl FromStr for WebAddress {
    type Err = NoAddress;

    /// A port, an IP address, or both; `localhost` stands for 127.0.0.1.
    fn from_str(text: &str) -> Result<Self, NoAddress> {
        let numbers = match text.strip_prefix("localhost") {
            Some(port) => format!("{}{port}", LOOPBACK.ip()),
            None => text.into(),
        };
        let port = numbers.parse().map(|port| SocketAddr::new(LOOPBACK.ip(), port));
        let address = numbers.parse().map(|address| SocketAddr::new(address, 0));
        let address = port.or(address).or_else(|_| numbers.parse());
        address.map(Self).map_err(|_| NoAddress { text: text.into() })
    }
}

impl fmt::Display for WebAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl WebAddress {
    /// Address and port; port 0 stands for any free one.
    pub(super) fn socket(self) -> SocketAddr {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ports_and_addresses_are_understood() {
        for (text, address) in [
            ("8080", "127.0.0.1:8080"),
            ("localhost", "127.0.0.1:0"),
            ("localhost:81", "127.0.0.1:81"),
            ("0.0.0.0", "0.0.0.0:0"),
            ("192.168.0.7:8080", "192.168.0.7:8080"),
            ("::1", "[::1]:0"),
            ("[::1]:9", "[::1]:9"),
        ] {
            assert_eq!(text.parse::<WebAddress>().unwrap().to_string(), address, "{text}");
        }
        for text in [
            "simulated",
            "/dev/ttyACM0",
            "",
            "70000",
            "127.0.0.1:x",
            "example.org:80",
        ] {
            let message = text.parse::<WebAddress>().unwrap_err().to_string();
            assert!(
                message.contains(text) && message.contains("127.0.0.1:8080"),
                "{message}"
            );
        }
    }
}
