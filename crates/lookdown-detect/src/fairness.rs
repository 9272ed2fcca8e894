//! Fairness between clients: the identity of a client, its priority levels, and budgets of which
//! one client may use half.

mod client;
mod priority_level;
mod shared_budget;

pub use client::Client;
pub use priority_level::{InvalidPriorityLevel, PriorityLevel};
pub use shared_budget::{BudgetError, BudgetShare, SharedBudget};
