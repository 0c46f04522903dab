//! SHA-256 as text.

use sha2::{Digest, Sha256};

/// Returns the digest in 64 hexadecimal digits.
pub fn to_hexadecimal(digest: Sha256) -> String {
    digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Returns the SHA-256 of several texts. Each text is preceded by its length, so that different
/// lists give different digests.
pub fn sha256(texts: &[&str]) -> String {
    let mut digest = Sha256::new();
    for text in texts {
        digest.update((text.len() as u64).to_le_bytes());
        digest.update(text.as_bytes());
    }
    to_hexadecimal(digest)
}

/// Returns true if the text is a digest, and therefore safe as a file name.
pub fn is_digest(text: &str) -> bool {
    text.len() == 64 && text.bytes().all(|c| c.is_ascii_digit() || (b'a'..=b'f').contains(&c))
}
