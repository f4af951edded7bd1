import type { ComponentChildren } from "preact";
import { useState } from "preact/hooks";
import { trying } from "../store/trouble";
import { Button } from "./Button";
import { useDraft } from "./draft";

interface Props {
  /** What it was named; null without a name. */
  name: string | null;
  /** What is shown in place of a name. */
  unnamed?: string;
  facts: string;
  onOpen?: () => Promise<unknown>;
  onRename?: (name: string | null) => Promise<unknown>;
  onDelete?: () => Promise<unknown>;
  current?: boolean;
  before?: ComponentChildren;
  progress?: ComponentChildren;
}

/** Something that is kept, in a list: opened by its name, renamed and deleted. */
export function KeptRow(props: Props) {
  const [naming, setNaming] = useState(false);
  const { field, end } = useDraft(props.name ?? "");
  const { facts, onOpen, onRename, onDelete, current, before, progress } = props;
  const name = props.name ?? props.unnamed ?? "";
  if (naming)
    return (
      <li>
        <input
          type="text"
          class="search"
          aria-label={`New name of ${name}`}
          maxLength={200}
          {...field}
          ref={(input) => input?.focus()}
          onChange={({ currentTarget: { value } }) => {
            const given = value.trim() || null;
            if (given !== props.name) trying(() => onRename!(given))();
          }}
          onBlur={() => {
            end();
            setNaming(false);
          }}
          onKeyDown={({ key, currentTarget }) => {
            if (key === "Escape") currentTarget.value = props.name ?? "";
            if (key === "Enter" || key === "Escape") currentTarget.blur();
          }}
        />
      </li>
    );
  return (
    <li>
      {before}
      <button
        type="button"
        class="choice"
        disabled={!onOpen}
        aria-current={current ? "true" : undefined}
        onClick={onOpen && trying(onOpen)}
      >
        <b>{name}</b>
        <small>{facts}</small>
        {progress}
      </button>
      {onRename && (
        <Button
          kind="quiet"
          icon="pencil"
          label={`Rename ${name}`}
          onClick={() => setNaming(true)}
        />
      )}
      {onDelete && (
        <Button kind="quiet" icon="trash" label={`Delete ${name}`} onClick={trying(onDelete)} />
      )}
    </li>
  );
}
