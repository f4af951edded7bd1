// A file of the answer in a format, by the service or by this page.
import { send } from "../store/client";
import { toolOfAnswer } from "../store/load";
import type { Answered } from "../store/state";
import { isText } from "./formats";
import { movejProgram } from "./movej";

export interface ExportedFile {
  name: string;
  blob: Blob;
  text: string;
  notes: string | null;
}

export interface Options {
  speed: number;
  output: number | null;
}

/** A file of the answer in a format. Throws Problem. */
export async function fileOf(
  shown: Answered,
  format: string,
  { speed, output }: Options,
  signal: AbortSignal,
): Promise<ExportedFile> {
  if (format === "movej") {
    const text = movejProgram(shown, speed, output, await toolOfAnswer(shown));
    return {
      name: `${shown.robot.name}-movej.script`,
      blob: new Blob([text], { type: "text/plain" }),
      text,
      notes: null,
    };
  }
  const { solution } = shown;
  const switched =
    output !== null && ["urscript", "krl"].includes(format)
      ? { [format]: { digital_output: output } }
      : {};
  const body = { answer: solution.answer ?? solution, speed_scale: speed, ...switched };
  const response = await send(`export/${format}`, {
    method: "POST",
    body: JSON.stringify(body),
    headers: { "Content-Type": "application/json" },
    signal,
  });
  const name =
    /filename="?([^";]+)/.exec(response.headers.get("Content-Disposition") ?? "")?.[1] ??
    `motion.${format}`;
  const blob = await response.blob();
  const text = isText(format) ? await blob.slice(0, 6000).text() : "A file of arrays.";
  return { name, blob, text, notes: response.headers.get("Joulepath-Notes") };
}
