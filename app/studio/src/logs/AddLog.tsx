import { useEffect, useState } from "preact/hooks";
import { Button } from "../ui/Button";
import { Dialog } from "../ui/Dialog";
import { Problem } from "../store/client";
import { robotName } from "../store/request";
import { robotList, type RobotSummary } from "../store/service";
import { request } from "../store/state";
import { linkOf, slugOf, tell } from "../store/trouble";
import { parseNumber } from "../store/units";
import { addLog, chosen, openedIdentification, openedLog } from "./model";

// the words of this dialog for the settings that the service names
const WORDS: Record<string, string> = {
  effort: "Meaning of efforts",
  columns: "Column names",
  units: "Unit of angles",
  current_units: "Unit of currents",
  payload: "Payload",
};

/** What the service says of a log, in the words of this dialog. */
const inWords = (text: string) =>
  text
    .replace(/effort=(\w+)/g, "“$1”")
    .replace(/`(\w+)`/g, (_, name: string) => (WORDS[name] ? `“${WORDS[name]}”` : name));

type Field =
  "file" | "name" | "robot" | "payload" | "units" | "current_units" | "effort" | "columns";

interface Why {
  field: Field;
  text: string;
  link: string | null;
}

// the fields of problems that name none
const FIELDS: Record<string, Field> = { "unknown-robot": "robot", "effort-not-usable": "effort" };
const NAMED: Field[] = ["name", "robot", "payload", "units", "current_units", "effort", "columns"];

/** What went wrong with a log, at the fields of this dialog; what none of them caused is at the file. */
function reasonsOf(error: unknown): Why[] {
  const details = error instanceof Problem ? error.details : {};
  const link = linkOf(details);
  const told = (details.errors ?? []).map(({ loc, msg }) => ({
    field: NAMED.find((each) => each === loc[1]) ?? "file",
    text: inWords(msg),
    link,
  }));
  if (told.length) return told;
  return [
    { field: FIELDS[slugOf(details)] ?? "file", text: inWords((error as Error).message), link },
  ];
}

/** How a file is to be read. */
export function AddLog({ file, onClose }: { file: File; onClose: () => void }) {
  const [settings, setSettings] = useState({
    name: file.name.slice(0, 80),
    robot: robotName(request.value),
    units: "rad",
    current_units: "A",
    effort: "auto",
    mass: "",
    columns: "",
  });
  const [why, setWhy] = useState<Why[]>([]);
  const [busy, setBusy] = useState(false);
  const [robots, setRobots] = useState<Pick<RobotSummary, "name" | "title">[]>([
    { name: settings.robot, title: settings.robot },
  ]);
  useEffect(() => {
    robotList().then(setRobots, (error) => tell(error));
  }, []);
  const set =
    (field: keyof typeof settings) =>
    ({ currentTarget: { value } }: { currentTarget: { value: string } }) =>
      setSettings((now) => ({ ...now, [field]: value }));
  const send = async () => {
    const { mass, columns, ...plain } = settings;
    const weight = parseNumber(mass);
    if (mass.trim() && weight === null)
      return setWhy([
        { field: "payload", text: "Enter a mass in kg, for example 1.5.", link: null },
      ]);
    setBusy(true);
    setWhy([]);
    try {
      const carried: Record<string, string> =
        weight === null
          ? {}
          : { payload: JSON.stringify({ mass: weight, com: weight ? [0, 0, 0.05] : undefined }) };
      const detail = await addLog(file, {
        ...plain,
        ...carried,
        ...(columns.trim() ? { columns: columns.trim() } : {}),
      });
      openedIdentification.value = null;
      openedLog.value = detail;
      chosen.value = [...new Set([...chosen.value, detail.id])];
      onClose();
    } catch (error) {
      setWhy(reasonsOf(error));
    } finally {
      setBusy(false);
    }
  };
  const choice = (field: "units" | "current_units" | "effort", text: string, options: string[]) => (
    <label>
      {text}
      <select aria-label={text} value={settings[field]} onChange={set(field)}>
        {options.map((each) => (
          <option key={each}>{each}</option>
        ))}
      </select>
    </label>
  );
  const told = (field: Field) =>
    why
      .filter((each) => each.field === field)
      .map(({ text, link }) => (
        <p class="error" role="alert" key={text} data-field={field}>
          {text} {link && <a href={link}>What this means</a>}
        </p>
      ));
  return (
    <Dialog
      title={`Add ${file.name}`}
      onClose={onClose}
      footer={
        <Button kind="primary" id="add-log" disabled={busy} onClick={send}>
          Add the log
        </Button>
      }
    >
      <div class="fields">
        {told("file")}
        <label>
          Name <input type="text" value={settings.name} onInput={set("name")} />
        </label>
        {told("name")}
        <label>
          Robot{" "}
          <select value={settings.robot} onChange={set("robot")}>
            {robots.map(({ name, title }) => (
              <option key={name} value={name}>
                {title}
              </option>
            ))}
          </select>
        </label>
        {told("robot")}
        <label>
          Payload, kg{" "}
          <input
            type="text"
            inputMode="decimal"
            placeholder="unknown"
            value={settings.mass}
            onInput={set("mass")}
          />
        </label>
        {told("payload")}
        {choice("units", "Unit of angles", ["rad", "deg"])}
        {told("units")}
        {choice("current_units", "Unit of currents", ["A", "mA"])}
        {told("current_units")}
        {choice("effort", "Meaning of efforts", ["auto", "current", "torque", "external"])}
        {told("effort")}
        <label>
          Column names as JSON, if they are unusual{" "}
          <input
            type="text"
            value={settings.columns}
            placeholder="detected automatically"
            onInput={set("columns")}
          />
        </label>
        {told("columns")}
      </div>
    </Dialog>
  );
}
