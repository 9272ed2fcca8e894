//! Small files that operators change while the server runs: they are read again and again, and what is
//! wrong with them is told once.

use std::{
    fs::File,
    io::{self, Read},
    path::Path,
};

/// A hundred certificates take a tenth of it, a thousand keys a fifth.
const MAX_BYTES: u64 = 1 << 20;

/// Reads a file of at most 1 MiB.
///
/// # Errors
/// When it cannot be read, or is larger.
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    let mut content = Vec::new();
    let read = File::open(path)?
        .take(MAX_BYTES + 1)
        .read_to_end(&mut content)?;
    if read as u64 > MAX_BYTES {
        return Err(io::Error::other("it has more than 1 MiB"));
    }
    Ok(content)
}

/// Why the newest version of a file is not used, as it was last told.
#[derive(Debug, Default)]
pub struct Complaint(Option<String>);

impl Complaint {
    /// Nothing is wrong any more: the next problem is to be told, whatever it is.
    pub fn settle(&mut self) {
        self.0 = None;
    }

    /// Whether this problem is to be told: it is not the one that was told last.
    pub fn is_news(&mut self, problem: &str) -> bool {
        let is_news = self.0.as_deref() != Some(problem);
        if is_news {
            self.0 = Some(problem.to_owned());
        }
        is_news
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_problem_is_told_once_until_it_changes_or_goes() {
        let mut complaint = Complaint::default();
        let told = ["empty", "empty", "damaged", "empty"].map(|problem| complaint.is_news(problem));
        assert_eq!(told, [true, false, true, true]);
        complaint.settle();
        assert!(complaint.is_news("empty"));
    }
}
