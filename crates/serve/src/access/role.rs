//! What a person may do.

use serde::{Deserialize, Serialize};

/// The role of a session or of a token. A later one may do all that an earlier one may.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// Looks, and may stop the rig.
    Viewer,
    /// Also runs scans and operates the rig.
    Operator,
    /// Also invites others, makes tokens and takes the controls from their holder.
    Admin,
}

impl std::fmt::Display for Role {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Viewer => "viewer",
            Self::Operator => "operator",
            Self::Admin => "admin",
        })
    }
}

/// What a route asks of a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Authority {
    /// Nothing: the page itself and the log-in.
    Public,
    /// A session or token of any role. To stop the rig takes no more than this.
    View,
    /// The role of operator.
    Operate,
    /// The role of operator, and the controls of the rig.
    Control,
    /// The role of admin.
    Administer,
}

impl Authority {
    /// The lowest role with this authority; `None` if no session is needed.
    pub fn role(self) -> Option<Role> {
        match self {
            Self::Public => None,
            Self::View => Some(Role::Viewer),
            Self::Operate | Self::Control => Some(Role::Operator),
            Self::Administer => Some(Role::Admin),
        }
    }
}
