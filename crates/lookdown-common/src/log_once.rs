//! A problem that is logged once.

/// The last logged problem.
#[derive(Debug, Default)]
pub struct LogOnce(Option<String>);

impl LogOnce {
    /// Returns true if this problem is to be logged: it is not the last one.
    pub fn should_log(&mut self, problem: &str) -> bool {
        self.0.replace(problem.to_owned()).as_deref() != Some(problem)
    }

    /// Clears the problem. Returns true if there was one.
    pub fn clear(&mut self) -> bool {
        self.0.take().is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_problem_is_logged_once_until_it_changes_or_ends() {
        let mut log = LogOnce::default();
        assert!(log.should_log("refused"));
        assert!(!log.should_log("refused"));
        assert!(log.should_log("stalled"));
        assert!(log.clear());
        assert!(!log.clear());
        assert!(log.should_log("stalled"));
    }
}
