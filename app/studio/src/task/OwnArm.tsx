import { useState } from "preact/hooks";
import { Button } from "../ui/Button";
import { Problem, post } from "../store/client";
import { base64 } from "../store/share";
import { parseNumber } from "../store/units";

/** The links of a URDF at which an arm may end: those that carry nothing. */
function tipsOf(urdf: string): string[] {
  const tree = new DOMParser().parseFromString(urdf, "application/xml");
  const parents = new Set(
    [...tree.querySelectorAll("joint > parent")].map((each) => each.getAttribute("link")),
  );
  const links = [...tree.querySelectorAll("robot > link")].map(
    (each) => each.getAttribute("name") ?? "",
  );
  return links
    .filter((name) => name && !parents.has(name))
    .concat(links.filter((name) => parents.has(name)).reverse());
}

const NO_LINK = { field: "urdf", text: "The file describes no link: choose a URDF file." };

/** A robot of the user's own: its URDF, its meshes, and what a URDF does not say. */
export function OwnArm({ onAdded }: { onAdded: (name: string) => void }) {
  const [urdf, setUrdf] = useState("");
  const [meshes, setMeshes] = useState<string | null>(null);
  const [tips, setTips] = useState<string[]>([]);
  const [form, setForm] = useState({ name: "", tip: "", acceleration: "10", payload: "" });
  const [why, setWhy] = useState<{ field: string; text: string }[]>([]);
  const [busy, setBusy] = useState(false);
  const set =
    (field: keyof typeof form) =>
    ({ currentTarget: { value } }: { currentTarget: { value: string } }) =>
      setForm((now) => ({ ...now, [field]: value }));
  const read = async (file: File | undefined) => {
    if (!file) return;
    const text = await file.text();
    const found = tipsOf(text);
    setUrdf(text);
    setTips(found);
    const stem = file.name.replace(/\.\w+$/, "").toLowerCase();
    const name = stem.replace(/[^a-z0-9_-]+/g, "_");
    setForm((now) => ({ ...now, tip: found[0] ?? "", name: now.name || name }));
    setWhy(found.length ? [] : [NO_LINK]);
  };
  const add = async () => {
    const [acceleration, payload] = [parseNumber(form.acceleration), parseNumber(form.payload)];
    const missing = [
      !urdf && { field: "urdf", text: "Choose the URDF file." },
      urdf && !tips.length && NO_LINK,
      acceleration === null && { field: "acceleration", text: "Enter a number, for example 10." },
      payload === null && { field: "payload", text: "Enter a mass in kg." },
    ].filter((each) => each !== false && each !== "");
    setWhy(missing);
    if (missing.length) return;
    setBusy(true);
    try {
      await post("robots", {
        name: form.name,
        urdf,
        tip: form.tip,
        acceleration,
        payload,
        ...(meshes ? { meshes } : {}),
      });
      onAdded(form.name);
    } catch (error) {
      const fields = error instanceof Problem ? (error.details.errors ?? []) : [];
      setWhy(
        fields.length
          ? fields.map(({ loc, msg }) => ({ field: String(loc.at(1) ?? ""), text: msg }))
          : [{ field: "", text: (error as Error).message }],
      );
    } finally {
      setBusy(false);
    }
  };
  const said = (field: string) =>
    why
      .filter((each) => each.field === field)
      .map(({ text }) => (
        <small class="error" role="alert" key={text}>
          {text}
        </small>
      ));
  const known = ["urdf", "name", "tip", "acceleration", "payload", "meshes"];
  return (
    <div class="fields own-arm">
      <label>
        URDF file{" "}
        <input
          type="file"
          accept=".urdf,.xml"
          onChange={(event) => void read(event.currentTarget.files?.[0])}
        />
        {said("urdf")}
      </label>
      <label>
        Its meshes, as a ZIP file{" "}
        <input
          type="file"
          accept=".zip"
          onChange={async (event) => {
            const file = event.currentTarget.files?.[0];
            setMeshes(file ? base64(new Uint8Array(await file.arrayBuffer())) : null);
          }}
        />
        {said("meshes")}
      </label>
      <label>
        Name <input type="text" value={form.name} onInput={set("name")} />
        {said("name")}
      </label>
      <label>
        Flange: the link at the end of the arm
        <select value={form.tip} onChange={set("tip")}>
          {tips.map((tip) => (
            <option key={tip}>{tip}</option>
          ))}
        </select>
        {said("tip")}
      </label>
      <label>
        Largest joint acceleration, rad/s²{" "}
        <input
          type="text"
          inputMode="decimal"
          value={form.acceleration}
          onInput={set("acceleration")}
        />
        {said("acceleration")}
      </label>
      <label>
        Largest payload, kg{" "}
        <input type="text" inputMode="decimal" value={form.payload} onInput={set("payload")} />
        {said("payload")}
      </label>
      {why
        .filter(({ field }) => !known.includes(field))
        .map(({ field, text }) => (
          <p class="error" role="alert" key={text}>
            {field} {text}
          </p>
        ))}
      <p class="hint">
        Figures that a URDF does not contain (friction, rotors, electronics) are engineering
        defaults until you identify them from logs of your arm.
      </p>
      <Button kind="primary" disabled={busy} onClick={add}>
        Add the arm
      </Button>
    </div>
  );
}
