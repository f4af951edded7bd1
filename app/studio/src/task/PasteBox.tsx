import { Button } from "../ui/Button";
import { Note } from "../ui/Note";
import { answer, pasteWrong, question, read, rowOfPaste } from "./paste";

/** A place for what is copied from a pendant, a program or a table. */
export function PasteBox() {
  const asked = question.value;
  // what is not understood stays, to be corrected
  const take = (input: HTMLInputElement, text: string) => {
    input.value = read(text, rowOfPaste()) ? "" : text;
  };
  return (
    <div class="paste-box">
      <input
        type="text"
        id="paste"
        aria-label="Paste a pose, joint positions or a table"
        placeholder="Paste p[…], six numbers, or rows of a table"
        onPaste={(event) => {
          event.preventDefault();
          take(event.currentTarget, event.clipboardData?.getData("text/plain") ?? "");
        }}
        onInput={() => (pasteWrong.value = "")}
        onKeyDown={(event) => {
          if (event.key !== "Enter" || event.ctrlKey || !event.currentTarget.value.trim()) return;
          take(event.currentTarget, event.currentTarget.value);
        }}
      />
      {pasteWrong.value && (
        <p class="error" role="alert">
          {pasteWrong.value}
        </p>
      )}
      {asked && (
        <Note>
          <b>How should this be read?</b>
          <div class="readings" id="readings">
            {asked.choices.map((choice) => (
              <Button key={choice.echo} small onClick={() => answer(asked, choice)}>
                {choice.echo}
              </Button>
            ))}
            <Button small kind="quiet" onClick={() => (question.value = null)}>
              Neither
            </Button>
          </div>
        </Note>
      )}
    </div>
  );
}
