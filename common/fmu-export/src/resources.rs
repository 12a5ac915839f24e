//! Where the folder `resources` of an unpacked archive lies, as FMI 2.0 says it.

use std::path::PathBuf;

/// The path that a file URI means (RFC 8089): `file:///a%20b`, `file://localhost/a`, `file:/a`; none for other URIs.
pub(crate) fn path_of_uri(uri: &str) -> Option<PathBuf> {
    let rest = uri.strip_prefix("file:")?;
    let path = match rest.strip_prefix("//") {
        Some(authority) => &authority[authority.find('/')?..],
        None => rest,
    };
    let text = String::from_utf8(decoded(path.as_bytes())?).ok()?;
    // a drive of Windows: /C:/folder
    let drive = text.as_bytes().get(2) == Some(&b':') && text.starts_with('/');
    Some(PathBuf::from(if drive { &text[1..] } else { &text[..] }))
}

/// Bytes with their percent signs resolved; none where no two hexadecimal digits follow one.
fn decoded(bytes: &[u8]) -> Option<Vec<u8>> {
    let mut out = Vec::with_capacity(bytes.len());
    let mut rest = bytes;
    while let [first, tail @ ..] = rest {
        (out, rest) = match (first, tail) {
            (b'%', [high, low, tail @ ..]) => {
                let digit = |b: &u8| char::from(*b).to_digit(16);
                out.push(u8::try_from(16 * digit(high)? + digit(low)?).ok()?);
                (out, tail)
            }
            (b'%', _) => return None,
            (byte, tail) => {
                out.push(*byte);
                (out, tail)
            }
        };
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn file_uris_become_paths() {
        for (uri, path) in [
            ("file:///tmp/a%20b/resources", "/tmp/a b/resources"),
            ("file:/tmp/r", "/tmp/r"),
            ("file://localhost/tmp/%c3%a4", "/tmp/ä"),
            ("file:///C:/fmu/resources", "C:/fmu/resources"),
        ] {
            assert_eq!(path_of_uri(uri), Some(PathBuf::from(path)), "{uri}");
        }
        for wrong in ["http://a/b", "/tmp/r", "file:///a%2", "file:///a%zz", "file:///%ff"] {
            assert_eq!(path_of_uri(wrong), None, "{wrong}");
        }
    }
}
