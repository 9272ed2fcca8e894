//! Fairness between clients: the identity of a client, and budgets of which one client may use half.

mod client;
mod shared_budget;

pub use client::Client;
pub use shared_budget::{BudgetError, BudgetShare, SharedBudget};
