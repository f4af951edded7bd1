import { useEffect, useState } from "preact/hooks";
import { Button } from "../ui/Button";
import { Dialog } from "../ui/Dialog";
import { Icon } from "../ui/icons";
import { save } from "../store/share";
import { answered, project, toast } from "../store/state";
import { figure } from "../store/units";
import { energyOf } from "../store/facts";
import { fileOf, type ExportedFile, type Options } from "./file";
import { formatsFor, type Format } from "./formats";
import { Others } from "./Others";
import { Settings } from "./Settings";
import { Steps } from "./Steps";

const GROUPS = {
  robot: "For this",
  software: "For other software",
  makers: "For other manufacturers",
};
const MOVEJ: Format = {
  name: "movej",
  title: "Program, plain movej",
  about:
    "The configurations found, in a few lines to edit. The controller chooses path and time; clearance is not proven.",
  not: null,
  group: "robot",
};
const PAUSE = 400; // after the last change of an option [ms]

/** From the answer to a file: format, speed, outputs, and what to do before it runs. */
export function ExportDialog({ onClose }: { onClose: () => void }) {
  const shown = answered.value!;
  const [formats, setFormats] = useState<Format[]>([]);
  const [format, setFormat] = useState("");
  const [options, setOptions] = useState<Options>({ speed: 0.1, output: null });
  const [file, setFile] = useState<ExportedFile | null>(null);
  const [why, setWhy] = useState("");
  useEffect(() => {
    formatsFor(shown.robot).then(
      (all) => {
        const ur = all.some(({ name, not }) => name === "urscript" && !not);
        const offered = ur
          ? [
              all.find(({ name }) => name === "urscript")!,
              MOVEJ,
              ...all.filter(({ name }) => name !== "urscript"),
            ]
          : all;
        setFormats(offered);
        setFormat(
          offered.find(({ not, group }) => !not && group === "robot")?.name ??
            offered.find(({ not }) => !not)?.name ??
            "",
        );
      },
      (error: Error) => setWhy(error.message),
    );
  }, []);
  useEffect(() => {
    if (!format) return undefined;
    const own = new AbortController();
    setFile(null);
    setWhy("");
    const timer = setTimeout(() => {
      fileOf(shown, format, options, own.signal).then(
        setFile,
        (error: Error) => own.signal.aborted || setWhy(error.message),
      );
    }, PAUSE);
    return () => {
      clearTimeout(timer);
      own.abort();
    };
  }, [format, options]);
  const download = () => {
    if (!file) return;
    save(file.name, file.blob);
    toast.value = [
      file.notes,
      "Set payload, speed and safety limits on the controller before you run the file.",
    ]
      .filter(Boolean)
      .join("; ");
  };
  const footer = (
    <>
      <span class="chip warn">
        <Icon name="alert" />
        Not tested on hardware
      </span>
      <span class="space" />
      <Button onClick={onClose}>Cancel</Button>
      <Button kind="primary" icon="download" id="download" disabled={!file} onClick={download}>
        Download {file ? file.name : ""}
      </Button>
    </>
  );
  const title = (
    <>
      Export{" "}
      <small>
        {project.value.name} · {figure(energyOf(shown))} J · {figure(shown.solution.duration)} s
      </small>
    </>
  );
  return (
    <Dialog title={title} onClose={onClose} wide footer={footer}>
      <div class="export">
        <div class="formats" role="radiogroup" aria-label="Format">
          {(Object.keys(GROUPS) as (keyof typeof GROUPS)[]).map((group) => {
            const own = formats.filter((each) => each.group === group);
            return (
              own.length > 0 && (
                <div key={group}>
                  <h3>
                    {GROUPS[group]}
                    {group === "robot" ? ` ${shown.robot.title}` : ""}
                  </h3>
                  {own.map((each) => (
                    <button
                      type="button"
                      role="radio"
                      key={each.name}
                      data-format={each.name}
                      class="choice"
                      aria-checked={each.name === format}
                      disabled={Boolean(each.not)}
                      onClick={() => setFormat(each.name)}
                    >
                      <b>{each.title}</b>
                      <small>{each.not ?? each.about}</small>
                    </button>
                  ))}
                </div>
              )
            );
          })}
          <h3>Other files</h3>
          <Others />
        </div>
        <div class="export-file">
          <Settings format={format} options={options} onChange={setOptions} shown={shown} />
          <h3>
            File{" "}
            <small>
              {file ? `${file.name}, ${figure(file.blob.size / 1000)} kB` : why ? "" : "…"}
            </small>
            {file && (
              <Button
                kind="link"
                icon="copy"
                onClick={() =>
                  void file.blob.text().then((text) => navigator.clipboard?.writeText(text))
                }
              >
                Copy
              </Button>
            )}
          </h3>
          {why && (
            <p class="error" role="alert" id="export-error">
              {why}
            </p>
          )}
          {file && (
            <pre id="preview" tabIndex={0} aria-label="Beginning of the file">
              {file.text}
            </pre>
          )}
          <Steps shown={shown} speed={options.speed} format={format} />
        </div>
      </div>
    </Dialog>
  );
}
