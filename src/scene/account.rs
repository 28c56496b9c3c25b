//! How faithfully a picture shows what a file says.

/// What becomes of an extension that a file uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Standing {
    /// It is shown as its specification says.
    Exact,
    /// It is shown in another way: which.
    Approximated(&'static str),
    /// It is not known.
    Ignored,
}

impl Standing {
    /// In one word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Approximated(_) => "approximated",
            Self::Ignored => "ignored",
        }
    }
}

/// An extension that a file uses.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExtensionUse {
    /// Its name.
    pub name: String,
    /// The file says that it cannot be shown without.
    pub required: bool,
    /// What becomes of it.
    pub standing: Standing,
}
