//! `fieldgap serve user`: the users who may log in from other computers.

use std::io::{IsTerminal, stdin};
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Subcommand, ValueEnum};
use miette::{IntoDiagnostic, miette};

use super::output::{print, say};
use super::settings::settings_folder;
use fieldgap_serve::{Role, SHORTEST_PASSWORD, UserError, UserName, Users};

/// The file of the users.
#[derive(Debug, Args)]
pub(super) struct UserFileArg {
    /// File of the users [default: users.toml in the settings of fieldgap, ~/.config/fieldgap]
    #[arg(long, value_name = "FILE")]
    users: Option<PathBuf>,
}

impl UserFileArg {
    /// The file that was named, or that of the settings.
    pub(super) fn path(self) -> miette::Result<PathBuf> {
        self.users.or_else(|| Some(settings_folder()?.join("users.toml"))).ok_or_else(|| {
            miette!(
                help = "set HOME, or name a file with --users",
                "there is no folder of settings"
            )
        })
    }
}

/// The `serve user` command.
#[derive(Debug, Args)]
pub(super) struct ServeUser {
    #[command(subcommand)]
    task: Task,
}

#[derive(Debug, Subcommand)]
enum Task {
    /// Add a user; the password is asked for, or is the first line of the standard input
    Add {
        /// Name to log in with
        name: String,
        /// What the user may do
        #[arg(long, value_enum)]
        role: RoleArg,
        #[command(flatten)]
        file: UserFileArg,
    },
    /// Remove a user; open sessions of a running server end within a second
    Remove {
        /// Name of the user
        name: String,
        #[command(flatten)]
        file: UserFileArg,
    },
    /// List the users with their roles
    List {
        #[command(flatten)]
        file: UserFileArg,
    },
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum RoleArg {
    /// Looks, and may stop the rig
    Viewer,
    /// Also runs scans and operates the rig
    Operator,
    /// Also invites others and takes the controls
    Admin,
}

impl From<RoleArg> for Role {
    fn from(role: RoleArg) -> Self {
        match role {
            RoleArg::Viewer => Self::Viewer,
            RoleArg::Operator => Self::Operator,
            RoleArg::Admin => Self::Admin,
        }
    }
}

impl ServeUser {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        match self.task {
            Task::Add { name, role, file } => {
                let path = file.path()?;
                let mut users = Users::read(&path)?;
                let name = UserName::try_from(name).into_diagnostic()?;
                if users.all().iter().any(|user| user.name == name) {
                    // Before a password is asked for.
                    return Err(UserError::Known(name.as_str().to_owned())).into_diagnostic();
                }
                let (shown, role) = (name.as_str().to_owned(), role.into());
                users.add(name, role, &password()?).into_diagnostic()?;
                users.write(&path).into_diagnostic()?;
                say(format!("{shown} may log in; the users are in {}", path.display()));
            }
            Task::Remove { name, file } => {
                let path = file.path()?;
                let mut users = Users::read(&path)?;
                users.remove(&name).into_diagnostic()?;
                users.write(&path).into_diagnostic()?;
                say(format!("{name} cannot log in any more"));
            }
            Task::List { file } => {
                for user in Users::read(&file.path()?)?.all() {
                    print(&format!("{}\t{}\n", user.name.as_str(), user.role))?;
                }
            }
        }
        Ok(ExitCode::SUCCESS)
    }
}

/// A password: typed twice without being shown, or the first line of the standard input.
fn password() -> miette::Result<String> {
    if !stdin().is_terminal() {
        let mut line = String::new();
        stdin().read_line(&mut line).into_diagnostic()?;
        return Ok(line.trim_end_matches(['\r', '\n']).to_owned());
    }
    let asked = |question: &str| rpassword::prompt_password(question).into_diagnostic();
    let first = asked(&format!("Password, at least {SHORTEST_PASSWORD} characters: "))?;
    if asked("The same again: ")? != first {
        return Err(miette!(help = "start again", "the two passwords differ"));
    }
    Ok(first)
}
