//! Who may see the page: this computer, or who has the token.

use std::fmt::Write;
use std::net::{IpAddr, SocketAddr, UdpSocket};

use super::error::WebError;

/// Number of random bytes of a token: 128 bits cannot be guessed.
const TOKEN_BYTES: usize = 16;

/// Condition under which a request is answered.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Access {
    /// The server is reached from this computer only. The name in the request must be one of this computer: a page of
    /// another site, whose name was made to lead here (DNS rebinding), states the name of its site.
    Loopback,
    /// The server is reached from other computers: the request must have this token.
    Token(String),
}

/// Reason why a request is not answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Refusal {
    /// The request is for another site.
    Host,
    /// The request comes from a page of another site.
    Origin,
    /// The token is missing or wrong.
    Token,
}

impl Access {
    /// Access to a server at this address; with a new token unless the address is one of the loopback.
    ///
    /// # Errors
    /// The operating system gives no random numbers.
    pub(super) fn to(address: IpAddr) -> Result<Self, WebError> {
        Ok(if address.is_loopback() {
            Self::Loopback
        } else {
            Self::Token(random_text()?)
        })
    }

    /// Checks the heads `Host` and `Origin` and the query of a request.
    pub(super) fn check(
        &self,
        host: Option<&str>,
        origin: Option<&str>,
        query: Option<&str>,
    ) -> Result<(), Refusal> {
        let host = host.ok_or(Refusal::Host)?;
        match self {
            Self::Loopback if !is_of_this_computer(host) => return Err(Refusal::Host),
            Self::Token(token) if !has_token(query.unwrap_or_default(), token) => {
                return Err(Refusal::Token);
            }
            _ => {}
        }
        // A program that is no browser sends no origin, and no site can make it send one.
        match origin.map(|origin| origin.strip_prefix("http://")) {
            None => Ok(()),
            Some(Some(site)) if site.eq_ignore_ascii_case(host) => Ok(()),
            Some(_) => Err(Refusal::Origin),
        }
    }

    /// Address of the page for a browser, with the token if there is one.
    pub(super) fn url(&self, address: SocketAddr) -> String {
        let token = match self {
            Self::Loopback => String::new(),
            Self::Token(token) => format!("?token={token}"),
        };
        format!("http://{}/{token}", reachable(address))
    }
}

/// True if the name or address before the port is one of the loopback.
fn is_of_this_computer(host: &str) -> bool {
    let name = match host.strip_prefix('[') {
        Some(rest) => rest.split(']').next(),
        None => host.split(':').next(),
    };
    name.is_some_and(|name| {
        name.eq_ignore_ascii_case("localhost")
            || name.parse().is_ok_and(|address: IpAddr| address.is_loopback())
    })
}

/// True if the query has the token. The time of the comparison does not depend on the number of characters that match.
fn has_token(query: &str, token: &str) -> bool {
    let given = query.split('&').find_map(|pair| pair.strip_prefix("token="));
    let given = given.unwrap_or_default().as_bytes();
    let difference = given
        .iter()
        .zip(token.as_bytes())
        .fold(given.len() ^ token.len(), |all, (a, b)| {
            std::hint::black_box(all | usize::from(a ^ b))
        });
    difference == 0
}

/// Random text of hexadecimal digits.
///
/// # Errors
/// The operating system gives no random numbers.
pub(super) fn random_text() -> Result<String, WebError> {
    let mut bytes = [0; TOKEN_BYTES];
    getrandom::fill(&mut bytes).map_err(|error| WebError::Random {
        cause: error.to_string(),
    })?;
    let mut text = String::new();
    for byte in bytes {
        // Writing to a string cannot fail.
        let _ = write!(text, "{byte:02x}");
    }
    Ok(text)
}

/// The address at which other computers reach one that stands for all addresses of this computer: that of the network
/// card through which packets leave.
fn reachable(address: SocketAddr) -> SocketAddr {
    if !address.ip().is_unspecified() {
        return address;
    }
    // The connection of a UDP socket chooses a network card and sends nothing; the address is one for documentation.
    let own = UdpSocket::bind("0.0.0.0:0").and_then(|socket| {
        socket.connect("192.0.2.1:9")?;
        socket.local_addr()
    });
    own.map_or(address, |own| SocketAddr::new(own.ip(), address.port()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn on_the_loopback_only_names_of_this_computer_are_answered() {
        let access = Access::Loopback;
        for host in [
            "127.0.0.1:8080",
            "localhost:8080",
            "LOCALHOST",
            "[::1]:9",
            "127.0.0.2",
        ] {
            assert_eq!(access.check(Some(host), None, None), Ok(()), "{host}");
        }
        for host in [
            "example.org:8080",
            "127.0.0.1.example.org",
            "",
            "localhost.example.org",
            "192.168.0.7",
        ] {
            assert_eq!(access.check(Some(host), None, None), Err(Refusal::Host), "{host}");
        }
        assert_eq!(access.check(None, None, None), Err(Refusal::Host));
    }

    #[test]
    fn a_page_of_another_site_is_refused() {
        let from = |origin| Access::Loopback.check(Some("127.0.0.1:8080"), Some(origin), None);
        assert_eq!(from("http://127.0.0.1:8080"), Ok(()));
        for origin in [
            "http://example.org",
            "null",
            "https://127.0.0.1:8080",
            "http://127.0.0.1:9",
        ] {
            assert_eq!(from(origin), Err(Refusal::Origin), "{origin}");
        }
    }

    #[test]
    fn another_address_needs_the_whole_token() {
        let access = Access::to("192.168.0.7".parse().unwrap()).unwrap();
        let Access::Token(token) = &access else {
            panic!("no token");
        };
        assert_eq!(token.len(), 2 * TOKEN_BYTES);
        assert_ne!(access, Access::to("192.168.0.7".parse().unwrap()).unwrap());
        let with = |query: &str| access.check(Some("mill.example:80"), None, Some(query));
        assert_eq!(with(&format!("token={token}")), Ok(()));
        assert_eq!(with(&format!("a=b&token={token}")), Ok(()));
        for query in [
            "",
            "token=",
            &format!("token={token}0"),
            &format!("token={}", &token[1..]),
        ] {
            assert_eq!(with(query), Err(Refusal::Token), "{query}");
        }
        let url = access.url("192.168.0.7:8080".parse().unwrap());
        assert_eq!(url, format!("http://192.168.0.7:8080/?token={token}"));
    }
}
