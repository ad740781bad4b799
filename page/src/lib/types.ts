// Names for the literal types of the messages.
import type { CallMessage, Explain, Race } from '../schema'

export type Call = NonNullable<CallMessage['call']>
export type Status = Race['status']
export type Marks = Race['marks']
export type Mark = Marks[string]
export type Method = Explain['method']
