//! A problem that is logged once.

/// The last logged problem.
#[derive(Debug, Default)]
pub struct LogOnce(Option<String>);

impl LogOnce {
    /// Returns true if this problem is to be logged: it is not the last one.
    pub fn is_changed(&mut self, problem: &str) -> bool {
        let is_changed = self.0.as_deref() != Some(problem);
        if is_changed {
            self.0 = Some(problem.to_owned());
        }
        is_changed
    }

    /// Clears the problem. Returns true if there was one.
    pub fn settle(&mut self) -> bool {
        self.0.take().is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_problem_is_logged_once_until_it_changes_or_ends() {
        let mut log = LogOnce::default();
        assert!(log.is_changed("refused"));
        assert!(!log.is_changed("refused"));
        assert!(log.is_changed("stalled"));
        assert!(log.settle());
        assert!(!log.settle());
        assert!(log.is_changed("stalled"));
    }
}
